"""Install the top-level folders under one name: `sim/` is `muslin.sim`, and so on."""

from setuptools import find_packages, setup

FOLDERS = ["garments", "sim", "learn", "eval"]
PACKAGES = [
    f"muslin.{name}"
    for folder in FOLDERS
    for name in [folder, *(f"{folder}.{subfolder}" for subfolder in find_packages(folder))]
]

setup(packages=PACKAGES, package_dir={"muslin": "."})
