#!/usr/bin/python3
"""The robot of two_machines_test.py: publishes a drive as it goes on, and prints what came back as JSON."""
import argparse
import json
import os
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [os.path.join(HERE, '../../bench/navigation'), HERE]
import latency_player  # noqa: E402


def main():
    options = argparse.Namespace(drive=sys.argv[1], seconds=float(sys.argv[2]), speed=1.0, arrival=5.0, odometry_every=1)
    player = latency_player.Player(options, lambda: True)
    row = player.play()
    row['positions'] = player.positions
    json.dump(row, sys.stdout)


if __name__ == '__main__':
    main()
