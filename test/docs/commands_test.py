#!/usr/bin/python3
"""Every command in the documentation is run, or checked as far as it can be.

usage: commands_test.py SOURCE_FOLDER PLANAR_VSLAM_EXECUTABLE

A command is a line of a block fenced as `sh`, or an inline code span that begins like one. `planar_vslam ...` runs on a
small simulated drive, with the substitutions and additions below; launch files are read by roslaunch; scripts are looked
at for the options they are given; packages are looked up in scripts/packages.txt. What cannot be checked stands in
NOT_RUN with its reason. A command that none of this covers fails the test.
"""
import glob
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import unittest

SOURCE, EXECUTABLE = '', ''
DOCUMENTS = ['README.md', 'ARCHITECTURE.md', 'CONTRIBUTING.md', 'BENCHMARK.md', 'planar/README.md', 'mapping2d/README.md', 'docs/*.md',
             'docs/benchmarks/README.md', 'examples/README.md']
FIRST_WORDS = ('planar_vslam', 'rosrun', 'roslaunch', 'rosservice', 'rostopic', 'catkin', 'catkin_make', 'apt-get', 'sudo', 'cmake', 'ctest')
FOLDERS = ('scripts/', 'bench/accuracy/', 'bench/navigation/', 'bench/speed/', 'build/devel/lib/', '.ci/', 'test/')
LONGEST = 60  # s, of one command

# Words of the documentation -> what is there in the scratch folder. Longer ones first.
SUBSTITUTIONS = [
    ('groundtruth.txt', 'drive/groundtruth_base.txt'), ('true_map.yaml', 'drive/groundtruth_grid.yaml'), ('trajectory.txt', 'results/trajectory.txt'),
    ('map.yaml', 'results/map.yaml'), ('mechatronics_lab', 'sample_lab'), ('south_hall', 'sample_lab'), ('FILE.yaml', 'out.yaml'), ('FILE.ply', 'out.ply'),
    ('results', 'bag_results'), ('FILE.pvm', 'lab.pvm'), ('monday.pvm', 'lab.pvm'), ('building.pvm', 'lab.pvm'), ('tuesday.pvm', 'lab.pvm'),
    ('LOG', 'log.carmen'), ('INPUT', 'drive'), ('WORLD', 'sample_lab'), ('DIR', 'out'),
]
# Subcommand -> arguments that make it short.
ADDITIONS = {'simulate': ['--until', '3', '--quiet', '--threads', '1'], 'run': ['--until', '8', '--quiet'],
             'calibrate': ['--passes', '1', '--until', '10', '--quiet']}
NEED_ARGUMENTS = ('run', 'calibrate', 'evaluate', 'grid', 'grid-score', 'simulate', 'map')
# Regular expression of a whole command -> why it is not run.
NOT_RUN = [
    (r'catkin build', 'builds the package in a workspace: minutes; the build that this test belongs to is the same'),
    (r'catkin config --install', 'as catkin build'),
    (r'catkin_make( install)?', 'as catkin build'),
    (r'cd \S+', 'a folder of the reader'),
    (r'(\.|source) \S*(devel|install)/setup\.bash', 'exists after a build only'),
    (r'rosservice call /slam/\S+ .*|rosservice call /\S+( .*)?', 'needs a running node: its name is looked up in src/ros below'),
    (r'rosrun map_server .*', 'another package'),
    (r'rosrun nodelet .*', 'another package: test/ros/nodelet_test.py loads it'),
    (r'rosrun dynamic_reconfigure .*', 'needs a running node: test/ros/contract_test.py uses its client'),
    (r'planar_vslam doctor --live', 'needs a running robot: test/ros/doctor_live_test.py has one'),
    (r'rostopic echo \S+', 'needs a running node'),
    (r'roscore &', 'a master of the reader'),
    (r'cmake .*', 'builds the example against an install tree: test/install does that'),
    (r'build/examples/\S+ .*', 'as cmake'),
    (r'clang-format-14 .*', 'a formatter, run by scripts/lint'),
]


def read(path):
    with open(os.path.join(SOURCE, path)) as file:
        return file.read()


def without_comment(line):
    return re.sub(r'\s+# .*$', '', line).strip()


def fenced_commands(text):
    for block in re.findall(r'^```sh\n(.*?)^```', text, re.DOTALL | re.MULTILINE):
        for line in re.sub(r'\\\n\s*', ' ', block).splitlines():
            line = without_comment(line)
            if line and not line.startswith('#'):
                yield from (part.strip() for part in re.split(r'&&|;', line))


def is_command(span):
    words = span.split()
    if len(words) < 2 and not span.startswith(('scripts/', 'bench/accuracy/', 'bench/navigation/', 'bench/speed/', '.ci/')):
        return False
    return '...' not in words and (words[0] in FIRST_WORDS or words[0].startswith(FOLDERS))


def inline_commands(text):
    prose = re.sub(r'^```.*?^```', '', text, flags=re.DOTALL | re.MULTILINE)
    for span in re.findall(r'`([^`\n]+)`', prose):
        span = span.replace('\\|', '|').strip()
        path = os.path.join(SOURCE, span)
        if is_command(span) and (os.access(path, os.X_OK) if os.path.isfile(path) else not os.path.isdir(path)):
            yield from (part.strip() for part in span.split('&&'))


def all_commands():
    """command -> documents that hold it"""
    found = {}
    for pattern in DOCUMENTS:
        for path in sorted(glob.glob(os.path.join(SOURCE, pattern))):
            name = os.path.relpath(path, SOURCE)
            text = read(name)
            for command in list(fenced_commands(text)) + list(inline_commands(text)):
                found.setdefault(command, []).append(name)
    return found


def is_not_run(command):
    return any(re.fullmatch(expression, command) for expression, _ in NOT_RUN)


def substituted(word):
    for placeholder, real in SUBSTITUTIONS:
        whole = r'(?<![A-Za-z_])' + re.escape(placeholder) + r'(?![A-Za-z_])'
        if re.search(whole, word):
            return re.sub(whole, real, word)
    return word


def alternatives(command):
    """`a|b|c` inside a command stands for one command each; `[--option]` for one with and one without it; other words in
    brackets are left out."""
    choice = re.search(r'(?<=\s)(\w[\w-]*(?:\|[\w-]+)+)', command)
    if choice:
        for one in choice.group(1).split('|'):
            yield from alternatives(command[:choice.start()] + one + command[choice.end():])
        return
    optional = re.search(r'\s\[([^\[\]]*)\]', command)
    if optional:
        yield from alternatives(command[:optional.start()] + command[optional.end():])
        if optional.group(1).startswith('--'):
            yield from alternatives(command[:optional.start()] + ' ' + optional.group(1) + command[optional.end():])
        return
    yield command


class Scratch:
    """A small recording as folder and bag, and a run of it."""

    def __init__(self):
        self.holder = tempfile.TemporaryDirectory(prefix='planar_vslam_docs_')
        self.folder = self.holder.name
        self.prepare(['simulate', 'sample_lab', '--out', 'drive', '--bag', 'drive.bag', '--until', '14', '--quiet'])
        self.prepare(['run', 'drive', '--out', 'results', '--save-map', os.path.join(self.folder, 'lab.pvm'), '--quiet'])
        with open(self.folder + '/my.yaml', 'w') as file:
            file.write('mapping2d:\n  band_max: 1.2\n')
        with open(self.folder + '/log.carmen', 'w') as file:
            ranges = ' '.join(['2.0'] * 180)
            file.writelines('FLASER 180 %s %.2f 0 0 %.2f 0 0 %d robot %d\n' % (ranges, x / 10, x / 10, x, x) for x in range(20))

    def prepare(self, arguments):
        code, error = self.call(arguments)
        if code != 0:
            raise RuntimeError('planar_vslam %s: %s' % (' '.join(arguments), error))

    def call(self, arguments):
        done = subprocess.run([EXECUTABLE] + arguments, cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                              timeout=LONGEST, check=False)
        return done.returncode, done.stderr.strip()


class Commands(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scratch = Scratch()
        cls.addClassCleanup(cls.scratch.holder.cleanup)
        cls.done = set()

    def test_all_are_covered_and_work(self):
        commands = all_commands()
        self.assertGreater(len(commands), 30, 'few commands were found: has the markup changed?')
        for command, documents in commands.items():
            for one in alternatives(command):
                with self.subTest(command=one, documents=documents):
                    self.check(one)

    def test_blocks_of_commands_are_marked(self):
        for pattern in DOCUMENTS:
            for path in glob.glob(os.path.join(SOURCE, pattern)):
                for line in read(os.path.relpath(path, SOURCE)).splitlines():
                    word = line.split()[0] if line.startswith('    ') and line.strip() else ''
                    self.assertFalse(word in FIRST_WORDS or word.startswith(FOLDERS), '%s: a command outside a block fenced as sh: %s' % (path, line.strip()))

    def check(self, command):
        words = shlex.split(re.sub(r'\s>\s*\S+$', '', command))
        while words and re.fullmatch(r'[A-Z_]+=.*', words[0]):
            words = words[1:]
        if words[:2] == ['rosrun', 'planar_vslam']:
            return self.check_node(words[2], words[3:])
        if words[0] == 'planar_vslam':
            return None if is_not_run(command) else self.check_run(words[1:])
        if words[0] == 'roslaunch':
            return self.check_launch(words[1:])
        if words[0].startswith(('scripts/', '.ci/', 'bench/accuracy/', 'bench/navigation/', 'bench/speed/', 'test/')):
            return self.check_script(words[0], words[1:])
        if words[0].startswith('build/devel/lib/planar_vslam/'):
            return self.check_built(os.path.basename(words[0]))
        if 'apt-get' in words:
            return self.check_packages([w for w in words if not w.startswith('-')][words.index('apt-get') + 2:])
        self.assertTrue(is_not_run(command), 'nothing here knows how to check it')
        if words[0] == 'rosservice':
            self.check_service(words[2])

    def check_run(self, words):
        words = [substituted(word) for word in words]
        if all(re.fullmatch(r'[a-z-]+', word) for word in words) and words[0] in NEED_ARGUMENTS and len(words) < 3:
            words.append('--help')  # only named
        key = tuple(words)
        if key in self.done:
            return
        self.done.add(key)
        added = [] if words[-1] in ('--help', '-h') else ADDITIONS.get(words[0], [])
        present = set(words)
        pairs = [added[i:i + 2] if not added[i] == '--quiet' else added[i:i + 1] for i in range(len(added)) if added[i].startswith('--')]
        words = words + [a for pair in pairs if pair[0] not in present for a in pair]
        code, error = self.scratch.call(words)
        self.assertEqual(code, 0, 'planar_vslam %s: %s' % (' '.join(words), error))

    def check_node(self, name, words):
        if name == 'planar_vslam':
            return self.check_run(words)
        self.assertIn(name, read('src/ros/CMakeLists.txt'), 'no such node')

    def check_launch(self, words):
        self.assertEqual(words[0], 'planar_vslam')
        if shutil.which('roslaunch') is None:
            self.skipTest('no roslaunch here: built without ROS')
        words = [word.replace('$PWD', self.scratch.folder) for word in words if word != '&']
        done = subprocess.run(['roslaunch', '--nodes'] + words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False,
                              env={**os.environ, 'ROS_PACKAGE_PATH': SOURCE + ':' + os.environ.get('ROS_PACKAGE_PATH', '/usr/share')}, timeout=LONGEST)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue(done.stdout.strip(), 'starts no node')
        known = set(re.findall(r'<arg name="(\w+)"', read('launch/' + words[1])))
        for word in words[2:]:
            if ':=' in word:
                self.assertIn(word.split(':=')[0], known, words[1] + ' has no such argument')

    def check_script(self, script, words):
        path = os.path.join(SOURCE, script)
        self.assertTrue(os.access(path, os.X_OK), 'no such script')
        text = read(script)
        if 'argparse' in text and script.startswith('bench/'):
            done = subprocess.run([path, '--help'], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
            self.assertEqual(done.returncode, 0, done.stdout)
            text += done.stdout
        elif 'python' in text.split('\n')[0]:
            compile(text, path, 'exec')
        else:
            self.assertEqual(subprocess.run(['bash', '-n', path], check=False).returncode, 0)
        if script == 'scripts/test':  # hands them to ctest
            return
        if script == 'scripts/build':
            return self.check_build(words)
        for word in words:
            if word.startswith('--'):
                self.assertIn(word, text, '%s has no such option' % script)

    def check_build(self, words):
        if words[:1] == ['--into']:
            words = words[2:]
        for word in words:
            if word.startswith('-D'):
                self.assertIn(word[2:].split('=')[0], read('CMakeLists.txt') + ''.join(
                    read(os.path.relpath(path, SOURCE)) for path in glob.glob(os.path.join(SOURCE, 'cmake/*.cmake'))))
            elif not word.startswith('-'):
                self.check_built(word)

    def check_built(self, name):
        kind, _, rest = name.partition('_')
        if kind == 'test':
            self.assertTrue(os.path.isdir(os.path.join(SOURCE, 'test', rest)) or 'add_executable(%s ' % name in read('test/ros/CMakeLists.txt'), 'no such test')
        elif kind == 'bench':
            self.assertTrue(glob.glob(os.path.join(SOURCE, 'bench/*', rest + '_bench.cpp')), 'no such benchmark')
        else:
            self.assertIn(name, read('src/ros/CMakeLists.txt') + read('src/cli/CMakeLists.txt'), 'no such target')

    def check_packages(self, packages):
        listed = set(re.findall(r'^[\w.+-]+', read('scripts/packages.txt'), re.MULTILINE))
        for package in packages:
            self.assertIn(package, listed, 'not in scripts/packages.txt')

    def check_service(self, name):
        sources = ''.join(read(os.path.relpath(path, SOURCE)) for path in glob.glob(os.path.join(SOURCE, 'src/ros/*.cpp')))
        self.assertIn('"%s"' % name.split('/')[-1], sources, 'no such service')


class BenchmarkPage(unittest.TestCase):
    def test_is_what_its_raw_results_say(self):
        page = read('BENCHMARK.md')
        folder = re.search(r'raw results in \[([^\]]+)\]', page).group(1)
        written = subprocess.run([os.path.join(SOURCE, 'bench/accuracy/benchmark_page'), os.path.join(SOURCE, folder)], stdout=subprocess.PIPE,
                                 text=True, check=True).stdout
        self.assertEqual(page, written, 'make it anew: bench/accuracy/benchmark_page %s --out BENCHMARK.md' % folder)


class Rules(unittest.TestCase):
    """The rules themselves, on made-up documents."""

    def test_commands_are_found(self):
        text = 'Say `planar_vslam run INPUT --out DIR` or `one_word`.\n```sh\nscripts/build    # builds\n. a/setup.bash && catkin build\n```\n```\nno command\n```\n'
        self.assertEqual(list(fenced_commands(text)), ['scripts/build', '. a/setup.bash', 'catkin build'])
        self.assertEqual(list(inline_commands(text)), ['planar_vslam run INPUT --out DIR'])

    def test_alternatives_are_spelt_out(self):
        self.assertEqual(list(alternatives('scripts/x a|b [--fast] [FILE]')), ['scripts/x a', 'scripts/x a --fast', 'scripts/x b', 'scripts/x b --fast'])

    def test_what_nobody_knows_fails(self):
        commands = Commands('test_all_are_covered_and_work')
        for command in ('frobnicate now', 'scripts/no_such_script', 'bench/accuracy/run_all --no-such-option', 'apt-get install no-such-package',
                        'rosrun planar_vslam no_such_node', 'rosservice call /no_such_service', 'build/devel/lib/planar_vslam/test_nothing'):
            with self.subTest(command=command), self.assertRaises(AssertionError):
                commands.check(command)


class RosInterface(unittest.TestCase):
    """docs/ros_api.md and src/ros name the same parameters, topics and services, and the launch files' arguments."""

    def setUp(self):
        self.sources = ''.join(read(os.path.relpath(path, SOURCE)) for path in sorted(glob.glob(os.path.join(SOURCE, 'src/ros/*.cpp'))))
        self.page = read('docs/ros_api.md')
        self.rows = set(re.findall(r'`([^`]+)`', ' '.join(re.findall(r'^\| ([^|]*)\|', self.page, re.MULTILINE))))

    def test_parameters(self):
        names = {'~' + name for name in re.findall(r'\bRead\("(\w+)"', self.sources)}
        self.assertGreater(len(names), 20)
        self.assertEqual(names, {row for row in self.rows if row.startswith('~')})

    def test_topics_and_services(self):
        names = re.findall(r'advertise<[^>]*>\(\s*"([^"]+)"|advertiseService\("([^"]+)"|subscribe<[^>]*>\("([^"]+)"|(?:Forward|Listen)<[^>]*>\("([^"]+)"', self.sources)
        self.assertGreater(len(names), 15)
        for name in (next(filter(None, groups)) for groups in names):
            self.assertIn(name, self.rows)

    def test_arguments_of_launch_files(self):
        for path in glob.glob(os.path.join(SOURCE, 'launch/*.launch')):
            with open(path) as file:
                for name in re.findall(r'<arg name="(\w+)"(?: default| doc|/)', re.sub(r'<include.*?</include>', '', file.read(), flags=re.DOTALL)):
                    self.assertRegex(self.page, '`%s`' % name, path)


class Links(unittest.TestCase):
    """Files and headings that documents point at are there."""

    def anchors(self, text):
        titles = re.findall(r'^#+ (.*)$', text, re.MULTILINE)
        return {re.sub(r'[^\w\- ]', '', title.strip().lower()).replace(' ', '-') for title in titles}

    def test_point_somewhere(self):
        for pattern in DOCUMENTS + ['docs/adr/*.md', 'docs/benchmarks/*.md']:
            for path in glob.glob(os.path.join(SOURCE, pattern)):
                for target in re.findall(r'\]\(([^)\s]+)\)', read(os.path.relpath(path, SOURCE))):
                    if re.match(r'https?:', target):
                        continue
                    file, _, anchor = target.partition('#')
                    there = os.path.normpath(os.path.join(os.path.dirname(path), file)) if file else path
                    with self.subTest(document=path, target=target):
                        self.assertTrue(os.path.exists(there))
                        if anchor and there.endswith('.md'):
                            self.assertIn(anchor, self.anchors(read(os.path.relpath(there, SOURCE))))


class SourceNames(unittest.TestCase):
    """Sources that documents name are there, and hold what the table of key classes says."""
    ROOTS = ('', 'src/', 'include/planar_vslam/', 'planar/include/planar_vslam/', 'mapping2d/include/planar_vslam/')

    def found(self, path):
        return next((root + path for root in self.ROOTS if os.path.exists(os.path.join(SOURCE, root + path))), None)

    def test_files_are_there(self):
        for pattern in DOCUMENTS + ['docs/adr/*.md']:
            for document in glob.glob(os.path.join(SOURCE, pattern)):
                for path in re.findall(r'`([\w/]+/\w+\.(?:h|cpp|yaml|py|cmake|srv|launch))`', read(os.path.relpath(document, SOURCE))):
                    with self.subTest(document=document, path=path):
                        self.assertIsNotNone(self.found(path))

    def test_key_classes_are_in_their_headers(self):
        page = read('ARCHITECTURE.md')
        rows = re.findall(r'^\| (`.*?) \| (`.*?) \|', page[page.index('## Key classes'):page.index('## Modules')], re.MULTILINE)
        self.assertGreater(len(rows), 30)
        for names, headers in rows:
            headers = re.findall('`([^`]+)`', headers)
            folder = os.path.dirname(headers[0])
            text = ''.join(read(self.found(h if '/' in h else folder + '/' + h)) for h in headers)
            for name in re.findall('`([^`]+)`', names):
                self.assertRegex(text, r'\b%s\b' % name, str(headers))


if __name__ == '__main__':
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    SOURCE, EXECUTABLE = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    unittest.main(argv=sys.argv[:1] + sys.argv[3:])
