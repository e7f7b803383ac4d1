"""What the parts of BENCHMARK.md are made with: raw results, figures as text, tables and sections in Markdown."""
import os

import common


class Results:
    """part -> record, as the scripts wrote them."""

    def __init__(self, folder):
        self.folder = folder
        self.parts = {name[:-5]: common.read_json(os.path.join(folder, name)) for name in sorted(os.listdir(folder)) if name.endswith('.json')}
        if not self.parts:
            common.fail('%s: holds no results' % folder)

    def first(self, part):
        return self.parts[part]['results'][0] if part in self.parts else None

    def run(self, part, name, drive='mapping'):
        """Of a part made by run_simulated, its first seed."""
        for record in self.parts.get(part, {'results': []})['results']:
            if record['run'] == name and record['drive'] == drive:
                return record
        return None

    def one(self, field):
        values = sorted({value for record in self.parts.values() for value in str(record[field]).split(', ')})
        return ', '.join(values)


def dig(value, path):
    """value['a']['b'] for 'a.b', or 'a/b' where keys have dots; None where something on the way is missing."""
    for key in path.split('/' if '/' in path else '.'):
        if value is None:
            return None
        value = value[int(key)] if isinstance(value, list) else value.get(key)
    return value


def metres(value):
    """Four digits for small ones."""
    return '-' if value is None else '%.3f' % value if value >= 0.0995 else '%.4f' % value


def percent(value, digits=2, sign=False):
    return '-' if value is None else ('%+.*f %%' if sign else '%.*f %%') % (digits, 100 * value)


def number(value, digits=1):
    return '-' if value is None else '%.*f' % (digits, value)


def ate(record, key='final'):
    return dig(record, key + '.ate_m.rmse')


def table(head, rows):
    rows = [row for row in rows if row]
    if not rows:
        return []
    return ['| ' + ' | '.join(head) + ' |', '|' + ' --- |' * len(head)] + ['| ' + ' | '.join(row) + ' |' for row in rows] + ['']


def section(title, text, *tables):
    body = [line for lines in tables for line in lines]
    return ['## ' + title, ''] + ([text, ''] if text else []) + body if body else []
