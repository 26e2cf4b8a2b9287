"""Use every public name, in an environment that may lack the extras: python every_name.py

A name that needs a package of an extra must say so by our own error.
"""

import importlib
import inspect
import pkgutil
import sys

import facewrinkle as fw
from facewrinkle.errors import MissingPackageError


def main() -> None:
    """Look at each name of the package and of its rooms."""
    assert fw.__file__.startswith(sys.prefix), f"{fw.__file__} is not that of {sys.prefix}"
    lacking = {f"facewrinkle.{name}" for name in fw.__all__ if not found(fw, name)}
    rooms = [room.name for room in pkgutil.iter_modules(fw.__path__) if room.name in fw.__all__]
    count = len(fw.__all__)
    for room in rooms:
        try:
            module = importlib.import_module(f"facewrinkle.{room}")
        except MissingPackageError:
            lacking.add(f"facewrinkle.{room}")
            continue
        names = getattr(module, "__all__", [name for name in vars(module) if not name.startswith("_")])
        count += len(names)
        lacking |= {f"facewrinkle.{room}.{name}" for name in names if not found(module, name)}
    assert count > 200, count
    print(f"{count} names of {len(rooms)} rooms; without the extras not there: {', '.join(sorted(lacking)) or 'none'}")


def found(module: object, name: str) -> bool:
    """Whether a name is there, with its documentation, or is refused by our own error."""
    try:
        inspect.getdoc(getattr(module, name))
    except MissingPackageError as error:
        if "pip install" not in str(error):
            raise
        return False
    return True


if __name__ == "__main__":
    main()
