"""Two machines joined by a link like Wi-Fi at its worst, as network namespaces and a relay in this process: no kernel module is
needed but tun. Packets get lost, and now and then the link stands still and then delivers what has come meanwhile."""
import collections
import fcntl
import os
import random
import select
import shutil
import struct
import subprocess
import threading
import time

TUNSETIFF, IFF_TUN, IFF_NO_PI = 0x400454ca, 0x0001, 0x1000
MTU = 2048  # bytes, at least


def reason_not_to():
    """Why there can be no such link here; empty where there can."""
    if os.geteuid() != 0:
        return 'network namespaces need root'
    if not shutil.which('ip') or not os.path.exists('/dev/net/tun'):
        return 'there is no ip command, or no /dev/net/tun'
    name = 'pv_probe_%d' % os.getpid()
    made = subprocess.run(['ip', 'netns', 'add', name], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode == 0
    if made:
        subprocess.run(['ip', 'netns', 'del', name], check=True)
    return '' if made else 'network namespaces are not allowed here'


class Way(threading.Thread):
    """Packets from one machine to the other."""

    def __init__(self, source, sink, loss, delay, stall, between, seed):
        super().__init__(daemon=True)
        self.source, self.sink, self.loss, self.delay, self.stall, self.between = source, sink, loss, delay, stall, between
        self.random, self.lost, self.carried, self.stop = random.Random(seed), 0, 0, False

    def run(self):
        waiting, next_stall, until = collections.deque(), time.monotonic() + self.between, 0.0
        while not self.stop:
            timeout = max(0.0, waiting[0][0] - time.monotonic()) if waiting else 0.1
            if select.select([self.source], [], [], timeout)[0]:
                packet = os.read(self.source, MTU)
                now = time.monotonic()
                if now > next_stall:
                    until, next_stall = now + self.random.uniform(0.0, self.stall), now + self.random.expovariate(1.0 / self.between)
                if self.random.random() < self.loss:
                    self.lost += 1
                else:
                    waiting.append((max(now + self.delay, until), packet))
            while waiting and waiting[0][0] <= time.monotonic():
                os.write(self.sink, waiting.popleft()[1])
                self.carried += 1


class TwoMachines:
    """`addresses` of both; `command(i, ...)` is one that runs on machine i."""

    def __init__(self, loss=0.02, delay=0.005, stall=0.3, between=1.0):
        self.names = ['pv_robot_%d' % os.getpid(), 'pv_laptop_%d' % os.getpid()]
        self.addresses, self.ends, self.ways = ['10.78.0.1', '10.78.0.2'], [], []
        try:
            for number, name in enumerate(self.names):
                self.add(number, name)
            self.ways = [Way(self.ends[a], self.ends[1 - a], loss, delay, stall, between, seed=a + 1) for a in (0, 1)]
            for way in self.ways:
                way.start()
        except BaseException:
            self.close()
            raise

    def add(self, number, name):
        def ip(*words):
            subprocess.run(['ip'] + list(words), check=True)
        device = 'pv%d_%d' % (number, os.getpid() % 10 ** 7)
        ip('netns', 'add', name)
        end = os.open('/dev/net/tun', os.O_RDWR)
        self.ends.append(end)
        fcntl.ioctl(end, TUNSETIFF, struct.pack('16sH22s', device.encode(), IFF_TUN | IFF_NO_PI, b''))
        ip('link', 'set', device, 'netns', name)
        ip('-n', name, 'address', 'add', self.addresses[number] + '/24', 'dev', device)
        for interface in ('lo', device):
            ip('-n', name, 'link', 'set', interface, 'up')

    def command(self, number, *words):
        return ['ip', 'netns', 'exec', self.names[number], 'env', 'ROS_IP=' + self.addresses[number],
                'ROS_MASTER_URI=http://%s:11311' % self.addresses[0]] + list(words)

    def close(self):
        for way in self.ways:
            way.stop = True
            way.join()
        for end in self.ends:
            os.close(end)
        for name in self.names:
            subprocess.run(['ip', 'netns', 'del', name], stderr=subprocess.DEVNULL)
