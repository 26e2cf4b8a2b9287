"""Check that VTK can draw off screen, and install or name the packages that are missing.

VTK needs libgl1 and libegl1 and ends in a segmentation fault without them, so the attempt runs in a subprocess. As
root on Debian or Ubuntu the two packages are installed; elsewhere a message says what to install.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys

PACKAGES = ["libgl1", "libegl1"]
PROBE = """
import pyvista as pv
plotter = pv.Plotter(off_screen=True, window_size=(32, 32))
plotter.add_mesh(pv.Sphere(), color="red")
image = plotter.screenshot(return_img=True)
plotter.close()
if image.min() == image.max():
    raise SystemExit("the picture is blank")
"""


def draws() -> tuple[bool, str]:
    """Return True if VTK can draw a sphere off screen, and the last line of its complaint."""
    environment = dict(os.environ)
    if sys.platform.startswith("linux"):
        environment.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    try:
        probe = subprocess.run(
            [sys.executable, "-c", PROBE], env=environment, capture_output=True, text=True, timeout=300
        )
    except subprocess.TimeoutExpired:
        return False, "no picture after five minutes"
    if probe.returncode == 0:
        return True, ""
    if probe.returncode < 0:
        return False, f"VTK crashed (signal {-probe.returncode}), as it does without the OpenGL libraries"
    complaint = probe.stderr.strip().splitlines()
    return False, complaint[-1] if complaint else f"exit status {probe.returncode}"


def installed() -> bool:
    """Install the packages with apt-get if run as root; return True if that worked."""
    if not (hasattr(os, "geteuid") and os.geteuid() == 0 and shutil.which("apt-get")):
        return False
    print(f"Installing {' and '.join(PACKAGES)} for off-screen drawing.", flush=True)
    environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    commands = (["apt-get", "update", "-q"], ["apt-get", "install", "-y", "-q", *PACKAGES])
    return all(subprocess.run(command, env=environment).returncode == 0 for command in commands)


def remedy() -> str:
    """Return a line that says what to install on this machine."""
    if shutil.which("apt-get"):
        packages = " ".join(PACKAGES)
        return f"Install the OpenGL libraries: sudo apt-get update && sudo apt-get install -y {packages}"
    if shutil.which("dnf"):
        return "Install the OpenGL libraries: sudo dnf install -y mesa-libGL mesa-libEGL"
    if shutil.which("apk"):
        return "VTK has no wheels for musl: use a Debian-based image, with libgl1 and libegl1."
    return "Install your system's OpenGL and EGL libraries (on Debian: libgl1 and libegl1)."


def main() -> int:
    """Return the exit status: 0 if VTK draws, 1 with a message if it does not."""
    works, complaint = draws()
    if not works and "No module named" not in complaint and installed():
        works, complaint = draws()
    if works:
        return 0
    if "No module named" in complaint:
        print(f"{complaint}. Run `make test`, which installs it, or: pip install -e .[all]", file=sys.stderr)
    else:
        print(f"VTK cannot draw off screen: {complaint}.\n{remedy()}", file=sys.stderr)
    return 1


if __name__ == "__main__":
    sys.exit(main())
