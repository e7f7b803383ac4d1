#!/usr/bin/python3
"""bench/speed says what it promises, on a short simulated drive. No time is asserted.

usage: speed_test.py SOURCE_FOLDER PLANAR_VSLAM_EXECUTABLE BENCH_ORB_EXECUTABLE
"""
import json
import os
import subprocess
import sys
import tempfile
import unittest

SOURCE, EXECUTABLE, BENCH_ORB = '', '', ''


def call(*arguments):
    return subprocess.run(arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False)


class Speed(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        holder = tempfile.TemporaryDirectory(prefix='planar_vslam_speed_')
        cls.addClassCleanup(holder.cleanup)
        cls.folder = holder.name
        done = call(EXECUTABLE, 'simulate', 'sample_lab', '--out', cls.folder + '/dev_lab', '--until', '4', '--quiet')
        assert done.returncode == 0, done.stderr

    def run_speed(self, *arguments):
        done = call(SOURCE + '/bench/speed/run_speed', self.folder, *arguments, '--executable', EXECUTABLE, '--bench', os.path.dirname(BENCH_ORB),
                    '--out', self.folder + '/out', '--turns', '1')
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def results(self, name):
        with open(os.path.join(self.folder, name)) as file:
            return json.load(file)['results']

    def test_orb_bench_counts_images(self):
        def images(*arguments):
            return json.loads(call(BENCH_ORB, self.folder + '/dev_lab', *arguments).stdout)['images']
        self.assertEqual(images('3'), (images() + 2) // 3)
        self.assertNotEqual(call(BENCH_ORB, self.folder).returncode, 0)

    def test_runs_in_turns_have_the_same_accuracy(self):
        printed = self.run_speed('dev_lab', 'dev_lab_localization', 'dev_lab_no_sweeps', '--beside', EXECUTABLE, '--json', self.folder + '/first.json')
        self.assertIn('costs so many times as much', printed)
        results = self.results('first.json')
        self.assertEqual([(r['run'], r['executable']) for r in results],
                         [(run, label) for run in ('dev_lab', 'dev_lab_localization', 'dev_lab_no_sweeps') for label in ('this', 'beside')])
        for ours, beside in zip(results[::2], results[1::2]):
            self.assertEqual(ours['ate'], beside['ate'])
            self.assertAlmostEqual(ours['orbs'] * ours['orb_ms'], ours['cpu_ms'], delta=0.01 * ours['cpu_ms'])
            self.assertGreaterEqual(ours['frame_ms']['max'], ours['frame_ms']['p99'])
            self.assertGreater(ours['extraction_orbs'], 0)
            self.assertGreater(ours['peak_memory_mib'], 0)
        self.assertGreater(results[0]['keyframe_ms']['count'], 0)
        self.assertIsNone(results[2]['keyframe_ms'], 'localisation makes no keyframe')

        printed = self.run_speed('dev_lab', '--compare', self.folder + '/first.json')
        self.assertRegex(printed, r'first\.json: cost so many times as much\n.*\n +dev_lab .* 1\.00\n')

    def test_growth_is_told_by_size_and_lap(self):
        done = call(SOURCE + '/bench/speed/run_growth', '--sizes', '20,40', '--frames', '12', '--laps', '0', '--out', self.folder + '/out', '--executable', EXECUTABLE,
                    '--bench', os.path.dirname(BENCH_ORB), '--json', self.folder + '/growth.json')
        self.assertEqual(done.returncode, 0, done.stderr)
        results = self.results('growth.json')
        self.assertEqual([(r['kind'], r['keyframes']) for r in results], [('rooms', 20), ('rooms', 40), ('laps', 20), ('laps', 40)])
        for r in results:
            self.assertEqual(r['tracked'], 12)
            self.assertLess(r['largest_error_m'], 0.1)
            self.assertGreater(r['keyframe_ms']['count'], 0)
            self.assertGreater(r['bytes_a_keyframe'], 10000)
        laps = json.loads(call(os.path.dirname(BENCH_ORB) + '/bench_laps', self.folder + '/dev_lab', '1.5').stdout)['laps']
        self.assertEqual(len(laps), 3)
        self.assertGreater(laps[-1]['file_mib'], 0)

    def test_what_is_not_there_is_left_out(self):
        self.assertIn('kitti_raw: not in', self.run_speed('kitti_raw'))


if __name__ == '__main__':
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    SOURCE, EXECUTABLE, BENCH_ORB = (os.path.abspath(argument) for argument in sys.argv[1:4])
    unittest.main(argv=sys.argv[:1] + sys.argv[4:])
