"""Long trials of the package: ``python -m tools.trials --help`` lists them."""
