"""run_goals' ROS side: what the simulated robot says of itself, and goals by move_base's action."""
import math
import time

import actionlib
import common
import goals_parts
import localise_parts
import rospy
from actionlib_msgs.msg import GoalStatus
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, Twist
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from nav_msgs.msg import OccupancyGrid, Odometry
from std_msgs.msg import Float64

LONGEST, PATIENCE = 300.0, 120.0  # s: simulated, for a goal; of wall time, for a message
SETTLED = 1.2                     # s of wall time after a goal: the simulator reports once a second
COUNTS = ('collisions', 'caught', 'bumps')  # of the simulator: drove into, walked into while it moved, while it stood
UNDER_WAY = 0.7                   # m driven before a mishap


class Client:
    """`alive` says whether the nodes still run."""

    def __init__(self, alive):
        self.alive = alive
        self.said = dict.fromkeys(COUNTS, 0)
        rospy.init_node('run_goals', disable_signals=True)
        self.cmd_vel = rospy.Publisher('cmd_vel', Twist, queue_size=1)
        self.kidnap = rospy.Publisher('kidnap', PoseStamped, queue_size=1)
        self.cover = rospy.Publisher('cover_camera', Float64, queue_size=1)
        rospy.Subscriber('ground_truth', Odometry, self.on_truth, queue_size=20)
        rospy.Subscriber('ground_truth_map', OccupancyGrid, lambda m: self.said.update(truth_map=m))
        rospy.Subscriber('map', OccupancyGrid, lambda m: self.said.update(map=m))
        rospy.Subscriber('pose', PoseWithCovarianceStamped, lambda m: self.said.update(located=True))
        rospy.Subscriber('/diagnostics', DiagnosticArray, self.on_diagnostics)
        self.action = actionlib.SimpleActionClient('move_base', MoveBaseAction)

    def on_truth(self, message):
        p, q = message.pose.pose.position, message.pose.pose.orientation
        self.said.update(pose=(p.x, p.y, 2.0 * math.atan2(q.z, q.w)), time=message.header.stamp.to_sec())

    def on_diagnostics(self, message):
        for status in message.status:
            for pair in status.values:
                if pair.key in COUNTS:
                    self.said[pair.key] = int(pair.value)

    def wait(self, key):
        self.wait_until(lambda: key in self.said, PATIENCE, 'nothing was heard of: ' + key)
        return self.said[key]

    def wait_until(self, true, patience, complaint):
        until = time.time() + patience
        while not true():
            if not self.alive():
                common.fail('the nodes ended')
            if time.time() > until:
                common.fail(complaint)
            time.sleep(0.05)

    def find_place(self):
        """Turns in place until slam_node says where the robot is."""
        self.wait('pose')
        turn, until = Twist(), time.time() + PATIENCE
        turn.angular.z = 0.3
        while 'located' not in self.said:
            if not self.alive() or time.time() > until:
                common.fail('the robot was not found in the map')
            self.cmd_vel.publish(turn)
            time.sleep(0.1)
        self.cmd_vel.publish(Twist())
        self.wait_until(lambda: self.action.wait_for_server(rospy.Duration(0.5)), PATIENCE, 'nobody offers the action move_base')

    def carry(self, place):
        message = PoseStamped()
        message.header.frame_id = 'world'
        message.pose.position.x, message.pose.position.y = place[:2]
        message.pose.orientation.z, message.pose.orientation.w = math.sin(place[2] / 2), math.cos(place[2] / 2)
        self.kidnap.publish(message)

    def drive_to(self, goal, T_truth_map, mishap=None):
        """A row about the goal. `mishap` is called once the robot is under way."""
        x, y, yaw = localise_parts.compose(localise_parts.inverse(T_truth_map), goal)
        message = MoveBaseGoal()
        message.target_pose.header.frame_id = 'map'
        message.target_pose.pose.position.x, message.target_pose.pose.position.y = x, y
        message.target_pose.pose.orientation.z, message.target_pose.pose.orientation.w = math.sin(yaw / 2), math.cos(yaw / 2)
        before, begun, wall = dict(self.said), self.said['time'], time.time()
        self.action.send_goal(message)
        state, happened = self.result(begun, mishap)
        seconds, passed = self.said['time'] - begun, time.time() - wall
        time.sleep(SETTLED)
        error_m, error_deg = goals_parts.end_error(self.said['pose'], goal)
        return {'goal': goal, 'reached': state == GoalStatus.SUCCEEDED, 'text': self.text(state), 'seconds': seconds, 'error_m': error_m,
                'error_deg': error_deg, 'mishap': happened, 'real_time': seconds / passed,
                **{key: self.said[key] - before[key] for key in COUNTS}}

    def result(self, begun, mishap):
        """The action's state, None where it took too long, and whether the mishap happened. The state is asked for: a transition
        that comes before send_goal returns is not heard of."""
        ended = (GoalStatus.SUCCEEDED, GoalStatus.ABORTED, GoalStatus.PREEMPTED, GoalStatus.REJECTED, GoalStatus.LOST)
        start, happened = self.said['pose'], False
        while self.action.get_state() not in ended:
            if mishap and math.dist(start[:2], self.said['pose'][:2]) > UNDER_WAY:
                mishap()
                mishap, happened = None, True
            if not self.alive():
                common.fail('the nodes ended')
            if self.said['time'] - begun > LONGEST:
                self.action.cancel_goal()
                return None, happened
            time.sleep(0.02)
        return self.action.get_state(), happened

    def text(self, state):
        return 'not there after %g s' % LONGEST if state is None else self.action.get_goal_status_text()
