"""Run a command when no other one runs that was started in this way.

Usage: python tools/alone.py LOCK COMMAND ...

The command holds the lock of the file LOCK, and gives it back when it ends, however it ends.
"""

import fcntl
import os
import sys

lock = os.open(sys.argv[1], os.O_RDWR | os.O_CREAT)
try:
    fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
except BlockingIOError:
    print("Another make is building here: waiting for it ...", flush=True)
    fcntl.flock(lock, fcntl.LOCK_EX)
os.set_inheritable(lock, True)
os.execvp(sys.argv[2], sys.argv[2:])
