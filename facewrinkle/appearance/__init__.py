"""What is seen beside the skin, as meshes with colours and without a plotter: pictures and files share it."""
