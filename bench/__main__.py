"""`python -m bench` is `motorbench`, too."""

from motorbench.__main__ import main

if __name__ == "__main__":
    main()
