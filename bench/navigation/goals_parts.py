"""What run_goals needs beside ROS: free places of grids, goals drawn among them, and how far a pose is from its goal."""
import math
import random

import localise_parts

CLEARANCE, WAY = 0.5, 0.4  # m from any obstacle: of a goal, and of a way on which it surely can be reached


class Grid:
    """A nav_msgs/OccupancyGrid by what is free: known, and no obstacle."""

    def __init__(self, message):
        info = message.info
        self.width, self.height, self.resolution = info.width, info.height, info.resolution
        self.origin = (info.origin.position.x, info.origin.position.y)
        self.free = [0 <= value < 50 for value in message.data]

    def cell(self, x, y):
        u, v = math.floor((x - self.origin[0]) / self.resolution), math.floor((y - self.origin[1]) / self.resolution)
        return v * self.width + u if 0 <= u < self.width and 0 <= v < self.height else -1

    def centre(self, cell):
        return (self.origin[0] + (cell % self.width + 0.5) * self.resolution,
                self.origin[1] + (cell // self.width + 0.5) * self.resolution)

    def neighbours(self, cell):
        u, v = cell % self.width, cell // self.width
        return [(v + dv) * self.width + u + du for du, dv in ((1, 0), (-1, 0), (0, 1), (0, -1))
                if 0 <= u + du < self.width and 0 <= v + dv < self.height]

    def far_from_obstacles(self, distance):
        """For each cell whether all within `distance` (m) of its centre is free."""
        reach = int(distance / self.resolution) + 1
        disc = [(du, dv) for du in range(-reach, reach + 1) for dv in range(-reach, reach + 1)
                if math.hypot(du, dv) * self.resolution <= distance]
        far = list(self.free)
        for cell, free in enumerate(self.free):
            if free or not any(self.free[n] for n in self.neighbours(cell)):
                continue
            u, v = cell % self.width, cell // self.width
            for du, dv in disc:
                if 0 <= u + du < self.width and 0 <= v + dv < self.height:
                    far[(v + dv) * self.width + u + du] = False
        return far

    def reachable(self, start, passable):
        """Cells that are connected with the passable one nearest to `start` (x, y)."""
        candidates = [c for c, yes in enumerate(passable) if yes]
        if not candidates:
            return set()
        first = min(candidates, key=lambda c: math.dist(self.centre(c), start))
        found, waiting = {first}, [first]
        while waiting:
            for cell in self.neighbours(waiting.pop()):
                if passable[cell] and cell not in found:
                    found.add(cell)
                    waiting.append(cell)
        return found


def draw_goals(count, seed, truth, mapped, T_truth_map, T_truth_base):
    """Poses (x, y, yaw) in the truth's frame: free in the truth and in the map, and connected with the robot's place in both."""
    far, mapped_far = truth.far_from_obstacles(CLEARANCE), mapped.far_from_obstacles(CLEARANCE)
    T_map_truth = localise_parts.inverse(T_truth_map)
    in_truth = truth.reachable(T_truth_base[:2], truth.far_from_obstacles(WAY))
    in_map = mapped.reachable(localise_parts.compose(T_map_truth, T_truth_base)[:2], mapped.far_from_obstacles(WAY))
    places = []
    for cell in sorted(in_truth):
        there = mapped.cell(*localise_parts.compose(T_map_truth, truth.centre(cell) + (0.0,))[:2])
        if far[cell] and there in in_map and mapped_far[there]:
            places.append(truth.centre(cell))
    draw = random.Random(seed)
    return [draw.choice(places) + (draw.uniform(-math.pi, math.pi),) for _ in range(count)] if places else []


def end_error(pose, goal):
    """Metres and degrees."""
    return math.dist(pose[:2], goal[:2]), abs(math.degrees(localise_parts.wrapped(pose[2] - goal[2])))
