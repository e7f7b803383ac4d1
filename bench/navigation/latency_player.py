"""run_latency's ROS side: publishes a recorded drive as a robot does, and notes when poses come back."""
import pathlib
import time
import xmlrpc.client

import dataset_to_bag
import rosgraph
import rospy
import yaml
from geometry_msgs.msg import PoseWithCovarianceStamped
from planar_vslam.srv import SaveMap
from sensor_msgs.msg import CompressedImage

PATIENCE = 30.0  # s, for the node
TICKS = 100.0  # 1/s, of /proc


class Player:
    """`alive` says whether the node still runs."""

    def __init__(self, options, alive):
        self.options, self.alive = options, alive
        self.arrivals, self.poses, self.positions = {}, {}, []  # wall time, x and y of poses, by stamp (ns); s of the drive, x, y
        rospy.init_node('latency_player', disable_signals=True)
        rospy.Subscriber('pose', PoseWithCovarianceStamped, self.on_pose, queue_size=100, tcp_nodelay=True)
        self.messages = self.load()
        self.publishers = {topic: rospy.Publisher(topic, kind, queue_size=100, latch=topic == '/tf_static')
                           for topic, kind in {(t, type(m)) for _, t, m in self.messages}}
        self.wait(lambda: all(p.get_num_connections() for t, p in self.publishers.items() if t != '/scan'), 'slam_node')

    def on_pose(self, message):
        stamp, at = message.header.stamp.to_nsec(), message.pose.pose.position
        self.arrivals[stamp], self.poses[stamp] = time.time(), (at.x, at.y)

    def wait(self, condition, what):
        until = time.time() + PATIENCE
        while not condition():
            if time.time() > until or not self.alive():
                raise RuntimeError('waited in vain for ' + what)
            time.sleep(0.05)

    def load(self):
        folder = pathlib.Path(self.options.drive)
        calibration = yaml.safe_load((folder / 'calibration.yaml').read_text())
        odometry = list(dataset_to_bag.odometry(folder))
        # A reading comes as a message and as tf.
        thinned = [m for i, m in enumerate(odometry) if i // 2 % self.options.odometry_every == 0]
        messages = [dataset_to_bag.mounts(calibration)] + thinned
        messages += list(dataset_to_bag.scans(folder, calibration)) + list(dataset_to_bag.images(folder, calibration))
        end = rospy.Time(dataset_to_bag.EPOCH) + rospy.Duration.from_sec(self.options.seconds)
        return sorted((m for m in messages if m[0] <= end), key=lambda m: m[0])

    def cpu_seconds(self):
        with open('/proc/%d/stat' % self.pid) as file:
            fields = file.read().rpartition(')')[2].split()
        return (int(fields[11]) + int(fields[12])) / TICKS

    def play(self):
        node = xmlrpc.client.ServerProxy(rosgraph.Master('/latency_player').lookupNode('/slam'))
        self.pid = node.getPid('/latency_player')[2]
        start, images = time.time() + 0.5, []
        cpu = self.cpu_seconds()
        for stamp, topic, message in self.messages:
            at = start + (stamp.to_sec() - dataset_to_bag.EPOCH) / self.options.speed
            time.sleep(max(0.0, at + self.options.arrival / 1000.0 - time.time()))
            for one in message.transforms if topic.startswith('/tf') else [message]:
                one.header.stamp = rospy.Time.from_sec(at)
            if isinstance(message, CompressedImage):
                images.append((message.header.stamp.to_nsec(), at, stamp.to_sec() - dataset_to_bag.EPOCH))
            self.publishers[topic].publish(message)
        time.sleep(1.0)
        if not self.alive():
            raise RuntimeError('slam_node has ended')
        late = [1000.0 * (self.arrivals[stamp] - at) for stamp, at, _ in images if stamp in self.arrivals]
        self.positions = [(seconds,) + self.poses[stamp] for stamp, _, seconds in images if stamp in self.poses]
        share = (self.cpu_seconds() - cpu) / (time.time() - start)
        return {'images': len(images), 'poses': len(late), 'late_ms': late, 'cpu_share': share}

    def save_map(self, name):
        saved = rospy.ServiceProxy('save_map', SaveMap)(name)
        if not saved.success:
            raise RuntimeError('save_map: ' + saved.message)
