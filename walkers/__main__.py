"""``python -m walkers`` is the program ``walkers``."""

from walkers.main import main

if __name__ == "__main__":
    main()
