"""`python -m heptarm` is the command `heptarm`."""

from heptarm.cli.main import main

if __name__ == "__main__":
    main()
