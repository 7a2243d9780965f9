"""python -m twindisc_cli."""

from twindisc_cli.cli import main

if __name__ == "__main__":
    main()
