"""`python -m ffd_lightning COMMAND ...` is `ffd COMMAND ...`."""

from ffd_lightning.app.main import main

if __name__ == "__main__":
    main()
