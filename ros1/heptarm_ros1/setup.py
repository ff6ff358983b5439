"""Installs the node for catkin; heptarm itself comes from pip."""

from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

setup(**generate_distutils_setup(packages=["heptarm_ros1"], package_dir={"": "src"}))
