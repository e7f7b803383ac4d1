#!/usr/bin/python3
"""navigator drives the simulated robot by move_base's action: a goal is reached, bad ones are aborted, one is cancelled.

Map and pose are the simulator's truth: the frame `map` is its `world`.
"""
import math
import sys
import time
import unittest

import actionlib
import rospy
import rostest
import tf2_ros
from actionlib_msgs.msg import GoalStatus
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TransformStamped
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from nav_msgs.msg import OccupancyGrid, Odometry, Path
from planar_vslam.msg import State

PATIENCE = 120.0  # s of simulated time


def planar(message):
    p, q = message.pose.pose.position, message.pose.pose.orientation
    return p.x, p.y, 2.0 * math.atan2(q.z, q.w)


class Truth:
    """Publishes the true map and map -> odom, and remembers where the robot is."""

    def __init__(self):
        self.odometry = {}
        self.pose = None
        self.collisions = 0
        self.broadcaster = tf2_ros.TransformBroadcaster()
        self.map = rospy.Publisher('map', OccupancyGrid, queue_size=1, latch=True)
        self.subscribers = [rospy.Subscriber('ground_truth_map', OccupancyGrid, self.on_map),
                            rospy.Subscriber('odom', Odometry, self.on_odometry, queue_size=100),
                            rospy.Subscriber('ground_truth', Odometry, self.on_truth, queue_size=100),
                            rospy.Subscriber('/diagnostics', DiagnosticArray, self.on_diagnostics)]

    def on_map(self, message):
        message.header.frame_id = 'map'
        self.map.publish(message)

    def on_odometry(self, message):
        self.odometry = {message.header.stamp: planar(message)}

    def on_diagnostics(self, message):
        values = {pair.key: pair.value for status in message.status for pair in status.values}
        self.collisions = max(self.collisions, int(values.get('collisions', 0)))

    def on_truth(self, message):
        self.pose = planar(message)
        for x, y, yaw in list(self.odometry.values()):
            turn = self.pose[2] - yaw
            c, s = math.cos(turn), math.sin(turn)
            transform = TransformStamped()
            transform.header.stamp = message.header.stamp
            transform.header.frame_id, transform.child_frame_id = 'map', 'odom'
            transform.transform.translation.x = self.pose[0] - c * x + s * y
            transform.transform.translation.y = self.pose[1] - s * x - c * y
            transform.transform.rotation.z, transform.transform.rotation.w = math.sin(turn / 2), math.cos(turn / 2)
            self.broadcaster.sendTransform(transform)


def goal_at(x, y, yaw=0.0, frame='map'):
    goal = MoveBaseGoal()
    goal.target_pose.header.frame_id = frame
    goal.target_pose.pose.position.x, goal.target_pose.pose.position.y = x, y
    goal.target_pose.pose.orientation.z, goal.target_pose.pose.orientation.w = math.sin(yaw / 2), math.cos(yaw / 2)
    return goal


class Navigator(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.truth = Truth()
        cls.path = []
        cls.subscriber = rospy.Subscriber('move_base/NavfnROS/plan', Path, cls.path.append)
        cls.client = actionlib.SimpleActionClient('move_base', MoveBaseAction)
        assert cls.client.wait_for_server(rospy.Duration(PATIENCE))
        while cls.truth.pose is None:
            rospy.sleep(0.1)
        rospy.sleep(1.0)
        cls.start = cls.truth.pose

    def outcome(self, goal):
        self.client.send_goal(goal)
        self.assertTrue(self.client.wait_for_result(rospy.Duration(PATIENCE)), 'no result')
        return self.client.get_state(), self.client.get_goal_status_text()

    def ahead(self, distance):
        x, y, yaw = self.truth.pose
        return x + distance * math.cos(yaw), y + distance * math.sin(yaw)

    def test_1_bad_goals_are_aborted_with_a_text(self):
        for goal, word in ((goal_at(1000.0, 0.0), 'outside'), (goal_at(math.nan, 0.0), 'finite'),
                           (goal_at(1.0, 1.0, frame='nowhere'), 'nowhere'), (MoveBaseGoal(), 'frame')):
            state, text = self.outcome(goal)
            self.assertEqual(state, GoalStatus.ABORTED, text)
            self.assertIn(word, text)

    def test_2_a_goal_in_an_obstacle_is_aborted(self):
        grid = rospy.wait_for_message('map', OccupancyGrid, PATIENCE)
        cell = grid.data.index(100)
        x = grid.info.origin.position.x + (cell % grid.info.width + 0.5) * grid.info.resolution
        y = grid.info.origin.position.y + (cell // grid.info.width + 0.5) * grid.info.resolution
        state, text = self.outcome(goal_at(x, y))
        self.assertEqual(state, GoalStatus.ABORTED)
        self.assertIn('obstacle', text)

    def test_3_a_goal_is_reached(self):
        x, y = self.ahead(1.0)
        yaw = self.truth.pose[2] + 1.0
        state, text = self.outcome(goal_at(x, y, yaw))
        self.assertEqual(state, GoalStatus.SUCCEEDED, text)
        rospy.sleep(0.5)
        self.assertLess(math.hypot(self.truth.pose[0] - x, self.truth.pose[1] - y), 0.12)
        self.assertLess(abs(math.remainder(self.truth.pose[2] - yaw, 2 * math.pi)), math.radians(6.0))
        self.assertTrue(self.path)
        self.assertEqual(self.truth.collisions, 0)

    def test_4_a_cancelled_goal_stops_the_robot(self):
        self.client.send_goal(goal_at(*self.start))
        rospy.sleep(1.0)
        self.client.cancel_goal()
        self.assertTrue(self.client.wait_for_result(rospy.Duration(PATIENCE)))
        self.assertEqual(self.client.get_state(), GoalStatus.PREEMPTED)
        rospy.sleep(1.0)
        stopped = self.truth.pose
        rospy.sleep(1.0)
        self.assertLess(math.hypot(self.truth.pose[0] - stopped[0], self.truth.pose[1] - stopped[1]), 0.01)

    def test_5_a_goal_again_and_another_one_meanwhile(self):
        here = goal_at(*self.truth.pose)
        for _ in range(3):
            state, text = self.outcome(here)
            self.assertEqual(state, GoalStatus.SUCCEEDED, text)
        first = []
        self.client.send_goal(goal_at(*self.start), done_cb=lambda state, result: first.append(state))
        rospy.sleep(1.0)
        other = actionlib.SimpleActionClient('move_base', MoveBaseAction)
        self.assertTrue(other.wait_for_server(rospy.Duration(PATIENCE)))
        other.send_goal(here)
        self.assertTrue(other.wait_for_result(rospy.Duration(PATIENCE)))
        self.assertEqual(other.get_state(), GoalStatus.SUCCEEDED, other.get_goal_status_text())
        self.assertEqual(first, [GoalStatus.PREEMPTED])

    def test_6_a_state_that_is_no_longer_said_confirms_nothing(self):
        said = rospy.Publisher('state', State, queue_size=1)
        while said.get_num_connections() == 0:
            rospy.sleep(0.1)
        said.publish(State(localised_by='camera'))
        time.sleep(4.0)
        self.client.send_goal(goal_at(*self.truth.pose))
        self.assertFalse(self.client.wait_for_result(rospy.Duration(3.0)), 'reached by a pose that nobody confirms')
        for _ in range(100):
            said.publish(State(localised_by='camera'))
            if self.client.wait_for_result(rospy.Duration(0.2)):
                break
        self.assertEqual(self.client.get_state(), GoalStatus.SUCCEEDED, self.client.get_goal_status_text())


if __name__ == '__main__':
    rospy.init_node('navigator_test')
    rostest.rosrun('planar_vslam', 'navigator', Navigator, sys.argv)
