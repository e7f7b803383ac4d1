"""What the scripts of this folder and of bench/speed share: calling planar_vslam, rendering drives once, and results as files."""
import argparse
import datetime
import fcntl
import json
import math
import os
import platform
import subprocess
import sys
import time

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
EXECUTABLE = os.path.join(ROOT, 'build/devel/lib/planar_vslam/planar_vslam')
BENCH = os.path.join(ROOT, 'build/bench')
STARTED = time.time()


def fail(message):
    sys.exit('%s: %s' % (os.path.basename(sys.argv[0]), message))


def call(arguments):
    """Standard output of a command; the script ends with its last error line where it fails."""
    done = subprocess.run(arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False)
    if done.returncode != 0:
        fail('failed: %s: %s' % (' '.join(arguments), (done.stderr.strip().split('\n') or [''])[-1]))
    return done.stdout


def seed_range(text):
    """'3' is seeds 1 to 3, '2-4' is 2 to 4."""
    first, dash, last = text.partition('-')
    try:
        seeds = list(range(int(first), int(last) + 1)) if dash else list(range(1, int(first) + 1))
    except ValueError:
        seeds = []
    if not seeds or seeds[0] < 0:
        raise argparse.ArgumentTypeError("'%s': expected a number of seeds, or FIRST-LAST" % text)
    return seeds


def read_json(path):
    with open(path) as file:
        return json.load(file)


def add_common_arguments(parser, out):
    """--executable, --out, and where and under which name results are kept."""
    parser.add_argument('--executable', default=EXECUTABLE)
    parser.add_argument('--out', default=os.path.join(BENCH, out), help='folder of the runs')
    parser.add_argument('--json', help='also write the results to this file')
    parser.add_argument('--commit', help='of the executable; default: of this source tree')


def add_rendered_argument(parser):
    parser.add_argument('--rendered', default=os.path.join(BENCH, 'rendered'), help='folder of rendered drives: kept, and taken where they are there')


def add_bench_argument(parser):
    parser.add_argument('--bench', help='folder of bench_orb, bench_growth, bench_laps and libbench_cpu_clock.so; default: beside the executable, '
                        'or of this source tree')


def bench_program(options, name):
    """A program of bench/speed, and the clock that is preloaded into what it measures."""
    folders = [options.bench] if options.bench else [os.path.dirname(options.executable), os.path.dirname(EXECUTABLE)]
    for folder in folders:
        found = [os.path.abspath(os.path.join(folder, file)) for file in (name, 'libbench_cpu_clock.so')]
        if all(map(os.path.exists, found)):
            return found
    fail('%s: no such file, or no libbench_cpu_clock.so beside it; build them with scripts/build bench_speed' % os.path.join(folders[-1], name))


def check_executable(options):
    if not os.path.exists(options.executable):
        fail('%s: no such file; build it with scripts/build' % options.executable)
    os.makedirs(options.out, exist_ok=True)


def commit_of_tree():
    git = ['git', '-C', ROOT]
    try:
        commit = subprocess.run(git + ['rev-parse', '--short', 'HEAD'], stdout=subprocess.PIPE, text=True, check=True).stdout.strip()
        changed = subprocess.run(git + ['status', '--porcelain', '--untracked-files=no'], stdout=subprocess.PIPE, text=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError):
        return 'unknown'
    return commit + ('-changed' if changed.strip() else '')


def machine():
    system = platform.freedesktop_os_release().get('PRETTY_NAME', 'unknown') if hasattr(platform, 'freedesktop_os_release') else 'unknown'
    return {'cores': os.cpu_count(), 'system': system, 'load_1min': round(os.getloadavg()[0], 1)}


def write_results(options, results):
    """The raw results beside the command that made them."""
    if not options.json:
        return
    record = {'command': command_line(),
              'commit': options.commit or commit_of_tree(), 'date': datetime.date.today().isoformat(), 'machine': machine(),
              'seconds': round(time.time() - STARTED, 1), 'results': results}
    write_json(options.json, record)


def write_json(path, value):
    temporary = path + '.part'
    with open(temporary, 'w') as file:
        json.dump(rounded(value), file, indent=1)
        file.write('\n')
    os.replace(temporary, path)


def command_line():
    """As somebody else would type it: without the places of this machine."""
    places = ('--executable', '--recode', '--out', '--json', '--commit', '--rendered', '--maps', '--threads', '--bench')
    words, option = [os.path.relpath(os.path.abspath(sys.argv[0]), ROOT)], ''
    for argument in sys.argv[1:]:
        if argument.startswith('--'):
            option = argument
        if option in places:
            continue
        if os.path.isabs(argument):
            argument = 'DATA_FOLDER' + ('/' + os.path.basename(argument) if os.path.exists(argument + '/images.csv') else '')
        words.append("'%s'" % argument if ' ' in argument else argument)
    return ' '.join(words)


def rounded(value):
    """Floats to six digits: more is noise, and makes files long."""
    if isinstance(value, float):
        return float('%.6g' % value)
    if isinstance(value, dict):
        return {key: rounded(v) for key, v in value.items()}
    return [rounded(v) for v in value] if isinstance(value, (list, tuple)) else value


def evaluate(executable, estimate, truth, *placement):
    return json.loads(call([executable, 'evaluate', '--estimate', estimate, '--groundtruth', truth, '--json'] + list(placement)))


def consistency(executable, out, truth):
    """NEES of the poses as published; nothing where there are none."""
    estimate = out + '/trajectory_live.txt'
    if not os.path.exists(estimate) or os.path.getsize(estimate) == 0:
        return None
    return evaluate(executable, estimate, truth, '--consistency', out + '/covariance_live.csv')


def odometry_trajectory(csv, out):
    """odometry.csv (t,x,y,theta,...) as a TUM trajectory."""
    with open(csv) as lines, open(out, 'w') as target:
        for line in lines:
            if line[0].isdigit() or line[0] == '-':
                t, x, y, theta = line.split(',')[:4]
                half = float(theta) / 2
                target.write('%s %s %s 0 0 0 %.9f %.9f\n' % (t, x, y, math.sin(half), math.cos(half)))


def odometry_alone(executable, csv, out, truth, align='se2'):
    odometry_trajectory(csv, out)
    return evaluate(executable, out, truth, '--align', align)


def share_by_sight(report):
    frames = report['frames']
    return (frames['tracking'] + frames['relocalized']) / frames['total']


class Drives:
    """Simulated drives, each rendered once into a cache folder that several scripts may share at a time."""

    def __init__(self, executable, folder, threads=2):
        self.executable, self.folder, self.threads = executable, folder, threads

    def get(self, world, seed, drive='mapping', variants=(), until=None, sensors_only=False):
        name = '_'.join([os.path.splitext(os.path.basename(world))[0], str(seed)] + ([drive] if drive != 'mapping' else []) +
                        [v.replace('=', '-') for v in variants] + (['until-%g' % until] if until else []) + (['sensors'] if sensors_only else []))
        folder = os.path.join(self.folder, name)
        os.makedirs(self.folder, exist_ok=True)
        with open(folder + '.lock', 'w') as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not os.path.exists(folder + '/rendered'):
                self.render(world, folder, seed, drive, variants, until, sensors_only)
        return folder

    def render(self, world, folder, seed, drive, variants, until, sensors_only):
        print('  render ' + os.path.basename(folder), file=sys.stderr, flush=True)
        arguments = [self.executable, 'simulate', world, '--out', folder, '--seed', str(seed), '--drive', drive, '--quiet',
                     '--threads', str(self.threads)]
        for variant in variants:
            arguments += ['--variant', variant]
        if until:
            arguments += ['--until', str(until)]
        call(arguments + (['--sensors-only'] if sensors_only else []))
        with open(folder + '/rendered', 'w') as mark:
            mark.write(' '.join(arguments) + '\n')
