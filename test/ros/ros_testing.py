"""What tests of running nodes share: waiting for what has to happen, and looking at processes."""
import time

import rospy

PATIENCE = 120.0  # s of wall time: a loaded machine is slow, and waits end as soon as they can


def wait_for(condition, what, patience=PATIENCE):
    end = time.time() + patience
    while not condition():
        if time.time() > end or rospy.is_shutdown():
            raise AssertionError('waited in vain for ' + what)
        time.sleep(0.02)


class Recorder:
    """Everything a topic said."""

    def __init__(self, topic, kind):
        self.messages = []
        self.subscriber = rospy.Subscriber(topic, kind, self.messages.append, queue_size=1000)

    def stamps(self):
        return [m.header.stamp.to_sec() for m in list(self.messages)]


def resident_mib(pid):
    """Memory of a process."""
    with open('/proc/%d/status' % pid) as file:
        return next(int(line.split()[1]) for line in file if line.startswith('VmRSS:')) / 1024.0
