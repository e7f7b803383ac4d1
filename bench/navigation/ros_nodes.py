"""Nodes of a launch file, as one process group with a master of their own."""
import os
import signal
import socket
import subprocess
import time

import common


def free_port():
    with socket.socket() as probe:
        probe.bind(('127.0.0.1', 0))
        return probe.getsockname()[1]


def messages_of(executable):
    """Folder of the build's Python messages."""
    return os.path.join(os.path.dirname(os.path.abspath(executable)), '../python3/dist-packages')


class Nodes:
    """`launch`: text of a launch file, kept in `folder` with what the nodes say. `executable`: in the build whose nodes are started."""

    def __init__(self, launch, folder, executable):
        os.makedirs(folder, exist_ok=True)
        file_name = os.path.abspath(os.path.join(folder, 'nodes.launch'))
        with open(file_name, 'w') as file:
            file.write(launch)
        port = free_port()
        os.environ.update(ROS_MASTER_URI='http://127.0.0.1:%d' % port, ROS_IP='127.0.0.1', ROS_LOG_DIR=os.path.abspath(folder) + '/log')
        setup = os.path.join(os.path.dirname(os.path.abspath(executable)), '..', '..', 'setup.sh')
        self.log = open(os.path.join(folder, 'nodes.txt'), 'w')
        self.process = subprocess.Popen(['bash', '-c', '. "$1" && exec roslaunch -p %d "$2"' % port, 'nodes', os.path.abspath(setup), file_name],
                                        stdout=self.log, stderr=subprocess.STDOUT, start_new_session=True)
        until = time.time() + 30
        while time.time() < until and self.alive():
            with socket.socket() as probe:
                if probe.connect_ex(('127.0.0.1', port)) == 0:
                    return
            time.sleep(0.2)
        self.stop()
        common.fail('roslaunch did not start: see ' + self.log.name)

    def alive(self):
        return self.process.poll() is None

    def stop(self):
        """roslaunch ends its nodes, which have groups of their own, when it is interrupted."""
        for number, patience in ((signal.SIGINT, 25), (signal.SIGTERM, 10), (signal.SIGKILL, 5)):
            if not self.alive():
                break
            os.killpg(self.process.pid, number)
            try:
                self.process.wait(patience)
            except subprocess.TimeoutExpired:
                pass
        self.log.close()
