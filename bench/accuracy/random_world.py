"""One random world: made, rendered, driven and measured. Used by run_random."""
import bisect
import fcntl
import json
import math
import os
import re
import shutil
import subprocess

import common

# name -> settings of run
RUNS = {'laser': [], 'no laser': ['laser.match=false'], 'visual': ['init=visual']}
GRID_FIGURES = ('precision', 'recall', 'in_sight', 'wrong_free', 'wrong_occupied', 'known')
LEAST_POSES = 10  # of a trajectory that can be evaluated
LARGE_FILES = ('map.pvm', 'map.bt', 'points.pcd')
LONGEST = 1200  # s of one command; what takes longer hangs
LEAST_SLIP = (0.02, math.radians(1.0))  # m and rad that a slip has to change to count


class Failed(Exception):
    pass


def call(arguments):
    """Standard output; Failed says how a command ended that did not work."""
    try:
        done = subprocess.run(arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=LONGEST, check=False)
    except subprocess.TimeoutExpired:
        raise Failed('hangs: more than %d s' % LONGEST) from None
    if done.returncode < 0:
        raise Failed('crashes: signal %d' % -done.returncode)
    if done.returncode != 0:
        raise Failed((done.stderr.strip().split('\n') or [''])[-1])
    return done.stdout


def read_truth(path):
    """t, x, y, heading of every image"""
    poses = []
    with open(path) as lines:
        for line in lines:
            if line[0] != '#':
                t, x, y, _, qx, qy, qz, qw = map(float, line.split())
                poses.append((t, x, y, math.atan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz))))
    return poses


def moved(poses, start, end):
    """Metres driven and radians turned from one time to another."""
    times = [p[0] for p in poses]
    first, last = bisect.bisect_left(times, start), bisect.bisect_right(times, end)
    way = turn = 0.0
    for a, b in zip(poses[max(0, first - 1):last], poses[max(0, first - 1) + 1:last + 1]):
        share = max(0.0, min(end, b[0]) - max(start, a[0])) / (b[0] - a[0])
        way += share * math.hypot(b[1] - a[1], b[2] - a[2])
        turn += share * abs(math.remainder(b[3] - a[3], 2 * math.pi))
    return way, turn


def slips_made(text, poses):
    count = 0
    for at, duration, factor in re.findall(r'\{at: ([\d.]+), duration: ([\d.]+), factor: ([\d.]+)\}', text):
        way, turn = moved(poses, float(at), float(at) + float(duration))
        off = abs(float(factor) - 1)
        count += off * way > LEAST_SLIP[0] or off * turn > LEAST_SLIP[1]
    return count


def field(text, section, key):
    """A number, a list of numbers or a word of a section on one line of a world file."""
    line = re.search(r'^%s: (.*)$' % section, text, re.MULTILINE)
    found = re.search(r'[{ ]%s: (\[[^]]*\]|[^,}]*)' % key, line.group(1)) if line else re.search(r'^  %s: (.*)$' % key, text, re.MULTILINE)
    value = found.group(1)
    if value[0] == '[':
        return [float(v) for v in value[1:-1].split(',')]
    return float(value) if re.match(r'-?[\d.]', value) else value


def features(text, poses):
    """What the world is like, as far as it may say why an error is large."""
    size = field(text, 'camera', 'size')
    laser = field(text, 'laser', 'kind')
    return {'room': field(text, 'room', 'size'), 'base': field(text, 'drive', 'base'), 'length': moved(poses, poses[0][0], poses[-1][0])[0],
            'seconds': poses[-1][0] - poses[0][0], 'images': len(poses), 'speed': field(text, 'drive', 'speed'),
            'size': '%dx%d' % (size[0], size[1]), 'focal': field(text, 'camera', 'focal')[0], 'rate': field(text, 'camera', 'rate'),
            'height': field(text, 'camera', 'position')[2], 'tilt_down_deg': field(text, 'camera', 'tilt_down_deg'),
            'time_offset_ms': field(text, 'camera', 'time_offset_ms'), 'rolling_shutter_ms': field(text, 'camera', 'rolling_shutter_ms'),
            'laser_range': None if laser == 'none' else field(text, 'laser', 'range_max'),
            'wheel_scale': field(text, 'odometry', 'scale'), 'wheel_yaw_scale': field(text, 'odometry', 'yaw_scale'),
            'wheel_noise': field(text, 'odometry', 'translation_noise'), 'turn_noise_deg': field(text, 'odometry', 'rotation_noise_deg'),
            'posters': len(re.findall(r'^  - \{wall:', text, re.MULTILINE)), 'people': len(re.findall(r'^  - \{path:', text, re.MULTILINE)),
            'slips': slips_made(text, poses)}


class RandomWorld:
    """A seed's world in its folder."""

    def __init__(self, options, seed):
        self.options, self.seed = options, seed
        self.executable = options.executable
        name = '%s%d' % (options.kind + '_' if options.kind else '', seed)
        self.folder, self.out = os.path.join(options.rendered, 'random_' + name), os.path.join(options.out, name)
        self.choice = ['simulate', 'random', '--seed', str(seed)] + (['--kind', options.kind] if options.kind else [])

    def make(self):
        """Text of the world file, new or as it was; rendered if it is another one than was rendered before."""
        os.makedirs(self.options.rendered, exist_ok=True)
        os.makedirs(self.out, exist_ok=True)
        call([self.executable] + self.choice + ['--world-yaml', self.out + '/world.yaml'])
        with open(self.out + '/world.yaml') as file:
            text = file.read()
        with open(self.folder + '.lock', 'w') as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            self.render(text)
        return text

    def render(self, text):
        mark = self.folder + '/rendered.yaml'
        if os.path.exists(mark):
            with open(mark) as file:
                if file.read() == text:
                    return
        shutil.rmtree(self.folder, ignore_errors=True)
        call([self.executable] + self.choice + ['--out', self.folder, '--quiet', '--threads', '1'])
        with open(mark, 'w') as file:
            file.write(text)

    def remove_images(self):
        shutil.rmtree(self.folder)

    def run(self, name, base):
        """Folder of the run's results."""
        out = os.path.join(self.out, name.replace(' ', '_'))
        shutil.rmtree(out, ignore_errors=True)
        arguments = [self.executable, 'run', self.folder, '--out', out, '--quiet']
        if base == 'differential':
            arguments += ['--config', os.path.join(common.ROOT, 'config/differential.yaml')]
        for setting in RUNS[name] + self.options.set:
            arguments += ['--set', setting]
        call(arguments)
        return out

    def evaluate(self, estimate, truth, *placement):
        return json.loads(call([self.executable, 'evaluate', '--estimate', estimate, '--groundtruth', truth, '--json'] + list(placement)))

    def consistency(self, out, poses, covariances):
        covariances = os.path.join(out, covariances)
        if not os.path.exists(covariances):
            return None
        found = self.evaluate(os.path.join(out, poses), self.truth(), '--consistency', covariances)
        return {'nees': found['mean_nees'], 'within_95': found['within_95']}

    def truth(self):
        return self.folder + '/groundtruth_base.txt'

    def grid(self, out):
        """Figures of the navigation map against what the body would hit."""
        score = json.loads(call([
            self.executable, 'grid-score', '--map', out + '/map.yaml', '--groundtruth', self.folder + '/groundtruth_grid.yaml', '--trajectory',
            out + '/trajectory.txt', '--groundtruth-trajectory', self.truth(), '--json']))
        return {figure: score[figure] for figure in GRID_FIGURES}

    def errors(self, out):
        """Of a run; its large files go."""
        values = self.errors_of(out)
        for name in LARGE_FILES:
            if os.path.exists(os.path.join(out, name)):
                os.remove(os.path.join(out, name))
        return values

    def errors_of(self, out):
        report = common.read_json(out + '/report.json')
        frames, total = report['frames'], report['frames']['total']
        values = {'metric': report['metric'], 'odometry_share': frames['odometry'] / total, 'lost_share': frames['lost'] / total,
                  'ends_lost': ends_lost(out + '/status.csv'), 'slips': report['slips'], 'loops': len(report['loops']), 'keyframes': report['keyframes'],
                  'cpu_seconds': report['timing']['cpu_seconds'], 'initialized_after': report['initialized_after_seconds']}
        if poses_in(out + '/trajectory.txt') < LEAST_POSES:
            return {**values, 'coverage': 0.0}
        final = self.evaluate(out + '/trajectory.txt', self.truth(), '--align', 'se2' if report['metric'] else 'sim3')
        values.update(coverage=final['coverage'], ate=final['ate_m']['rmse'], largest=final['ate_m']['max'])
        if not report['metric']:
            return values
        live = self.evaluate(out + '/trajectory_live.txt', self.truth(), '--align', 'se2')
        values.update(ate_2d=final['ate_2d_m']['rmse'], live=live['ate_m']['rmse'], scale_error=final['scale_error'], sigma=report['scale']['sigma'],
                      live_honesty=self.consistency(out, 'trajectory_live.txt', 'covariance_live.csv'),
                      final_honesty=self.consistency(out, 'trajectory.txt', 'covariance.csv'), grid=self.grid(out))
        return values

    def measure(self):
        text = self.make()
        poses = read_truth(self.truth())
        what = features(text, poses)
        values = {'seed': self.seed, 'kind': self.kind(), **what, 'runs': {}}
        common.odometry_trajectory(self.folder + '/odometry.csv', self.out + '/odometry.txt')
        values['odometry'] = self.evaluate(self.out + '/odometry.txt', self.truth(), '--align', 'se2')['ate_m']['rmse']
        for name in self.options.runs:
            if name == 'laser' and what['laser_range'] is None:
                continue
            try:
                values['runs'][name] = self.errors(self.run(name, what['base']))
            except Failed as failure:
                values['runs'][name] = {'failed': str(failure)}
        if self.options.remove_images:
            self.remove_images()
        return values

    def kind(self):
        kinds = ('lab', 'office', 'hall', 'corridor', 'warehouse', 'mixed')
        return self.options.kind or kinds[self.seed % len(kinds)]


def poses_in(path):
    with open(path) as file:
        return sum(line[0] != '#' for line in file)


def ends_lost(status):
    """Whether the last image was not located: lost and never found again, or never a map."""
    with open(status) as file:
        last = file.read().strip().split('\n')[-1].split(',')
    return last[1] in ('lost', 'initializing')
