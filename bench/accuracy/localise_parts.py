"""What run_localise measures: cold starts and whole drives in a saved map, as poses against the truth."""
import bisect
import math
import os
import random
import shutil

import common

WRONG_M, WRONG_RAD = 0.5, math.radians(10)
STEP_M, STEP_RAD = 0.02, math.radians(1)  # of map -> odom at the robot, for each 50 ms
FIRST, LONGEST = 5.0, 15.0  # s after a cold start
GIVEN_M, GIVEN_RAD = 0.5, math.radians(15)  # that a given pose may be off


def compose(a, b):
    c, s = math.cos(a[2]), math.sin(a[2])
    return (a[0] + c * b[0] - s * b[1], a[1] + s * b[0] + c * b[1], wrapped(a[2] + b[2]))


def inverse(a):
    c, s = math.cos(a[2]), math.sin(a[2])
    return (-c * a[0] - s * a[1], s * a[0] - c * a[1], -a[2])


def wrapped(angle):
    return math.atan2(math.sin(angle), math.cos(angle))


class Path:
    """Planar poses by time."""

    def __init__(self, rows):
        self.times = [row[0] for row in rows]
        self.poses = [tuple(row[1:]) for row in rows]

    @staticmethod
    def tum(path):
        rows = []
        with open(path) as lines:
            for line in lines:
                if line.strip() and line[0] != '#':
                    t, x, y, _, _, _, qz, qw = map(float, line.split()[:8])
                    rows.append((t, x, y, 2 * math.atan2(qz, qw)))
        return Path(rows)

    @staticmethod
    def odometry(path):
        with open(path) as lines:
            return Path([tuple(map(float, line.split(',')[:4])) for line in lines if line[0].isdigit() or line[0] == '-'])

    def at(self, time):
        i = min(max(bisect.bisect_left(self.times, time), 1), len(self.times) - 1)
        (t0, a), (t1, b) = (self.times[i - 1], self.poses[i - 1]), (self.times[i], self.poses[i])
        share = min(max((time - t0) / (t1 - t0), 0.0), 1.0)
        return (a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]), wrapped(a[2] + share * wrapped(b[2] - a[2])))

    def length(self, begin, end):
        poses = [p for t, p in zip(self.times, self.poses) if begin <= t <= end]
        return sum(math.hypot(b[0] - a[0], b[1] - a[1]) for a, b in zip(poses, poses[1:]))


def placement_of_map(executable, out, truth):
    """T_truth_map of a mapping run."""
    place = common.evaluate(executable, out + '/trajectory.txt', truth, '--align', 'se2')['alignment']
    return (place['t'][0], place['t'][1], 2 * math.atan2(place['q_xyzw'][2], place['q_xyzw'][3]))


def errors(live, truth, T_truth_map):
    """(s, m, rad) of each pose as published."""
    result = []
    for time, pose in zip(live.times, live.poses):
        got, want = compose(T_truth_map, pose), truth.at(time)
        result.append((time, math.hypot(got[0] - want[0], got[1] - want[1]), abs(wrapped(got[2] - want[2]))))
    return result


class Runs:
    """Runs of one drive in one map."""

    def __init__(self, options, drive, saved, T_truth_map, out, settings):
        self.options, self.drive, self.saved, self.T_truth_map, self.out, self.settings = options, drive, saved, T_truth_map, out, settings
        self.truth = Path.tum(drive + '/groundtruth_base.txt')
        self.odometry = Path.odometry(drive + '/odometry.csv')

    def run(self, *more):
        arguments = [self.options.executable, 'run', self.drive, '--out', self.out, '--quiet', '--mode', 'localization', '--map', self.saved]
        for setting in self.settings + self.options.set:
            arguments += ['--set', setting]
        shutil.rmtree(self.out, ignore_errors=True)
        common.call(arguments + list(more))
        with open(self.out + '/status.csv') as lines:
            status = [line.strip().split(',') for line in lines][1:]
        live = self.out + '/trajectory_live.txt'
        return Path.tum(live) if os.path.exists(live) else Path([]), status

    def cold_start(self, begin):
        """begin: s after the first image. What came of it."""
        for span in (FIRST, LONGEST):
            live, status = self.run('--from', '%.3f' % begin, '--until', '%.3f' % (begin + span + 0.05))
            if live.times:
                break
        result = {'begin': begin, 'after_s': None, 'after_m': None, 'first_m': None, 'worst_m': None, 'wrong': False,
                  'ms': sum(float(row[4]) for row in status) / max(1, len(status))}
        if not live.times or not status:
            return result
        off = errors(live, self.truth, self.T_truth_map)
        start = float(status[0][0])
        result.update(after_s=live.times[0] - start, after_m=self.truth.length(start, live.times[0]), first_m=off[0][1],
                      worst_m=max(e[1] for e in off), wrong=any(e[1] > WRONG_M or e[2] > WRONG_RAD for e in off))
        return result

    def cold_starts(self, count, seed):
        last = self.truth.times[-1] - self.truth.times[0] - LONGEST - 1
        draw = random.Random('%s %d' % (os.path.basename(self.drive), seed))
        return [self.cold_start(draw.uniform(0.1, last)) for _ in range(count)]

    def cold_starts_every(self, seconds):
        """From the first image on, as long as there is time enough to be found."""
        count = int((self.truth.times[-1] - self.truth.times[0] - FIRST) / seconds) + 1
        return [self.cold_start(i * seconds + 0.001) for i in range(count)]

    def given_poses(self, count, seed):
        """Starts from a given pose within GIVEN_M and GIVEN_RAD of the truth: when camera or laser confirm it, and how far off it is then."""
        last = self.truth.times[-1] - self.truth.times[0] - FIRST - 1
        draw = random.Random('given %s %d' % (os.path.basename(self.drive), seed))
        results = []
        for _ in range(count):
            begin, off, aside = draw.uniform(0.1, last), GIVEN_M * math.sqrt(draw.random()), draw.uniform(-math.pi, math.pi)
            at = compose(inverse(self.T_truth_map), self.truth.at(self.truth.times[0] + begin))
            given = (at[0] + off * math.cos(aside), at[1] + off * math.sin(aside), wrapped(at[2] + draw.uniform(-GIVEN_RAD, GIVEN_RAD)))
            live, status = self.run('--from', '%.3f' % begin, '--until', '%.3f' % (begin + FIRST + 0.05), '--start-at=' + ','.join('%.4f' % v for v in given))
            results.append(self.confirmed(begin, live, status))
        return results

    def confirmed(self, begin, live, status):
        result = {'begin': begin, 'after_s': None, 'first_m': None, 'worst_m': None, 'wrong': False}
        times = [float(row[0]) for row in status if row[1] in ('tracking', 'relocalized')]
        if not times:
            return result
        off = [e for e in errors(live, self.truth, self.T_truth_map) if e[0] >= times[0] - 1e-6]
        result.update(after_s=times[0] - float(status[0][0]), first_m=off[0][1], worst_m=max(e[1] for e in off),
                      wrong=any(e[1] > WRONG_M or e[2] > WRONG_RAD for e in off))
        return result

    def whole_drive(self):
        live, status = self.run()
        if not live.times:
            return None
        off = errors(live, self.truth, self.T_truth_map)
        wheels = Path([(t,) + compose(compose(live.poses[0], inverse(self.odometry.at(live.times[0]))), self.odometry.at(t)) for t in live.times])
        alone = errors(wheels, self.truth, self.T_truth_map)
        rms = lambda rows: math.sqrt(sum(e[1] ** 2 for e in rows) / len(rows))
        place = ['--transform', ','.join('%.9g' % value for value in self.T_truth_map)]
        nees = common.evaluate(self.options.executable, self.out + '/trajectory_live.txt', self.drive + '/groundtruth_base.txt', '--consistency',
                               self.out + '/covariance_live.csv', *place)
        return {'nees': nees['mean_nees'], 'rmse_m': rms(off), 'max_m': max(e[1] for e in off), 'max_deg': math.degrees(max(e[2] for e in off)), 'wheels_rmse_m': rms(alone),
                'wheels_max_m': max(e[1] for e in alone), 'after_s': live.times[0] - float(status[0][0]), 'localised': self.localised(status),
                'steps': self.steps(live, status), 'ms': sum(float(row[4]) for row in status) / len(status)}

    @staticmethod
    def localised(status):
        """Share of images within a second of a pose that camera or laser confirmed."""
        confirmed, last = 0, -math.inf
        for row in status:
            last = float(row[0]) if row[1] in ('tracking', 'relocalized') else last
            confirmed += float(row[0]) - last <= 1.0
        return confirmed / len(status)

    def steps(self, live, status):
        """How often map -> odom moved by more than it may, but for declared jumps."""
        declared, count = {float(row[0]) for row in status if row[1] == 'relocalized'}, 0
        rows = list(zip(live.times, live.poses))
        for (t0, a), (t1, b) in zip(rows, rows[1:]):
            moved = compose(inverse(self.odometry.at(t0)), self.odometry.at(t1))
            step = compose(inverse(compose(a, moved)), b)
            share = max(1.0, (t1 - t0) / 0.05)
            count += t1 not in declared and (math.hypot(step[0], step[1]) > share * STEP_M or abs(step[2]) > share * STEP_RAD)
        return count


def pepper(drive, folder):
    """The drive as a robot with short-sighted lasers would have recorded it: three sectors of 60 degrees, 61 readings over 240 degrees, 1.5 m."""
    count, least, step, reach = 61, math.radians(-120), math.radians(4), 1.5
    os.makedirs(folder, exist_ok=True)
    for name in os.listdir(drive):
        if name not in ('scan.csv', 'calibration.yaml') and not os.path.lexists(os.path.join(folder, name)):
            os.symlink(os.path.abspath(os.path.join(drive, name)), os.path.join(folder, name))
    laser = {}
    with open(drive + '/calibration.yaml') as lines, open(folder + '/calibration.yaml', 'w') as target:
        for line in lines:
            if line.startswith('laser:'):
                fields = line.split('{')[1].split('}')[0].split(',')
                laser = {key.strip(): float(value) for key, value in (field.split(':') for field in fields)}
                line = 'laser: {angle_min: %.6f, angle_increment: %.6f, beams: %d, range_max: %.1f}\n' % (least, step, count, reach)
            target.write(line)
    with open(drive + '/scan.csv') as lines, open(folder + '/scan.csv', 'w') as target:
        for line in lines:
            stamp, *ranges = line.strip().split(',')
            if not stamp[:1].isdigit():
                continue
            kept = []
            for i in range(count):
                angle = least + i * step
                gap = math.radians(30) < abs(angle) < math.radians(60)
                beam = ranges[int(round((angle - laser['angle_min']) / laser['angle_increment']))]
                kept.append('inf' if gap or float(beam) >= reach else beam)
            target.write(','.join([stamp] + kept) + '\n')
    return folder
