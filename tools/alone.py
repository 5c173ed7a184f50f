"""Run a command when no other one runs that was started in this way.

Usage: python tools/alone.py LOCK COMMAND ...

The command holds the lock of the file LOCK, and gives it back when it ends, however it ends.
Nothing is run where Python could not read the name of the folder from its own files.
"""

import fcntl
import locale
import os
import signal
import sys
from contextlib import suppress


def main() -> None:
    """Wait for the lock, and become the command."""
    with suppress(locale.Error):  # an unknown one stands for C
        locale.setlocale(locale.LC_ALL, "")
    encoding = locale.nl_langinfo(locale.CODESET)
    try:
        os.fsencode(os.getcwd()).decode(encoding)
    except UnicodeDecodeError:
        sys.exit(
            f"The name of this folder, {os.getcwd()!a}, has letters that {encoding} lacks, the "
            f"character set of this terminal: set LC_ALL=C.UTF-8, or use another folder."
        )
    lock = os.open(sys.argv[1], os.O_RDWR | os.O_CREAT)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        print("Another make is building here: waiting for it ...", flush=True)
        fcntl.flock(lock, fcntl.LOCK_EX)
    os.set_inheritable(lock, True)
    # Python ignores it, and the command would do so too: a closed pipe would be an error.
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    os.execvp(sys.argv[2], sys.argv[2:])


if __name__ == "__main__":
    main()
