"""What the tests with ROS around a device or a session share: a master of their own, nodes and what they say, patience.

Imports no rospy: own_port() must be called before it, because rospy reads the environment when it is imported.
"""
import os
import signal
import socket
import subprocess
import tempfile
import time


def own_port():
    """Sets the environment to a master that is not there yet, on a free port. @return the port"""
    with socket.socket() as free:
        free.bind(("localhost", 0))
        port = free.getsockname()[1]
    os.environ.update(ROS_MASTER_URI=f"http://localhost:{port}", ROS_HOSTNAME="localhost")
    return port


def patient(condition, seconds=60.0):
    """Until the condition holds; whether it did."""
    end_of_patience = time.monotonic() + seconds
    while time.monotonic() < end_of_patience:
        if condition():
            return True
        time.sleep(0.02)
    return condition()


def master(port):
    """A ROS master's process that answers."""
    process = subprocess.Popen(["rosmaster", "--core", "-p", str(port)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def answers():
        with socket.socket() as s:
            return s.connect_ex(("localhost", port)) == 0

    assert patient(answers), "no master"
    return process


def end(process, seconds=30.0):
    """Interrupts a process; kills it where that does not help."""
    if process.poll() is None:
        process.send_signal(signal.SIGINT)
    try:
        process.wait(seconds)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


class Node:
    """A node, and what it says."""

    def __init__(self, package, name, *words, **environment):
        self.said = tempfile.TemporaryFile("w+")
        # Its own group: rosrun may be a shell around the node.
        self.process = subprocess.Popen(["rosrun", package, name, *words], stdout=self.said, stderr=subprocess.STDOUT,
                                        env={**os.environ, **environment}, start_new_session=True)

    def text(self):
        self.said.seek(0)
        return self.said.read()

    def memory(self):
        """Bytes in use."""
        with open(f"/proc/{self.process.pid}/statm", encoding="ascii") as f:
            return int(f.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")

    def signal(self, number):
        if self.process.poll() is None:
            os.killpg(self.process.pid, number)

    def end(self):
        """Interrupts it, kills it where that does not help. Idempotent."""
        self.signal(signal.SIGINT)
        try:
            self.process.wait(30)
        except subprocess.TimeoutExpired:
            self.signal(signal.SIGKILL)
            self.process.wait()
        self.said.close()
