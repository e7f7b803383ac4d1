"""The section Speed of BENCHMARK.md."""
from page_parts import dig, metres, number, section, table


def stage_table(stages, room):
    """The stages that took most of the time, two a row, as many as there is room for."""
    cells = [(t.get('sum', 0), ['`%s`' % stage] + [number(t.get(k), 2) for k in ('p50', 'p99')] + [number(t['sum'] / 1000) if 'sum' in t else '-'])
             for stage, t in stages.items() if t]
    kept = [row for _, row in sorted(cells, key=lambda cell: -cell[0])][:2 * max(room, 0)]
    half = (len(kept) + 1) // 2
    rows = [left + right for left, right in zip(kept[:half], kept[half:] + [[''] * 4])]
    return table(['stage (ms)', 'p50', 'p99', 'sum (s)'] * 2, rows)


# run, figure of run_speed -> at most
RUN_BARS = {('dev_lab', 'orbs'): 1.6, ('dev_lab', 'keyframe_orbs.p50'): 5, ('dev_lab', 'keyframe_orbs.p99'): 13, ('dev_lab', 'extraction_orbs'): 0.6,
            ('dev_lab', 'tracking_orbs'): 0.35, ('dev_lab', 'peak_memory_mib'): 150, ('dev_lab_localization', 'orbs'): 1.2}


def run_cell(record, path, digits):
    value, bar = dig(record, path), RUN_BARS.get((record['run'], path))
    shown = number(value, digits)
    return '**%s**' % shown if value is not None and bar is not None and value > bar else shown


def run_table(results, room):
    """Whole runs by run_speed, as many as there is room for."""
    records = [r for r in results.parts.get('speed-runs', {'results': []})['results'] if r['executable'] == 'this']
    rows = [['`%s`' % r['run']] + [', '.join(run_cell(r, path, digits) for path in paths) for paths, digits in (
        (['orbs'], 2), (['cpu_ms'], 1), (['real_time_factor'], 1), (['frame_ms.p50', 'frame_ms.p99'], 1), (['keyframe_orbs.p50', 'keyframe_orbs.p99'], 1),
        (['extraction_orbs', 'tracking_orbs'], 2), (['peak_memory_mib'], 0))] + [metres(r['ate']), metres(r['odometry_ate'])] for r in records]
    return table(['whole run', 'orbs an image', 'CPU ms', 'times real time', 'frame: p50, p99 ms', 'keyframe: p50, p99 orbs', 'extraction, tracking: orbs', 'MiB', 'ATE',
                  'odometry alone'], rows[:max(room, 0)])


def growth_text(results):
    records = results.parts.get('speed-growth', {'results': []})['results']
    text = ''
    for kind, name in (('rooms', 'through many rooms'), ('laps', 'round and round')):
        maps = [r for r in records if r['kind'] == kind]
        if len(maps) > 1:
            times = [maps[-1][figure]['p50'] / maps[0][figure]['p50'] for figure in ('frame_ms', 'keyframe_ms')]
            text += ' At %d keyframes %s a frame takes %.2f and a keyframe %.2f times what they take at %d; %.0f kB a keyframe.' % (
                maps[-1]['keyframes'], name, *times, maps[0]['keyframes'], maps[-1]['bytes_a_keyframe'] / 1000)
    drive = next((r for r in records if r['kind'] == 'drive' and r['last_against_early']), None)
    if drive:
        text += ' %d laps of `%s`, the last two against the second and the third: %s.' % (
            len(drive['laps']), drive['world'], ', '.join('%s %.2f x' % pair for pair in drive['last_against_early'].items()))
    return text


def speed(results, room):
    r, loop = results.first('speed'), results.first('speed-loop')
    if not r:
        return []
    timing = r['timing']
    text = '`run dev_lab`, one thread, nothing else running: %.1f times real time, %.1f ms of CPU an image, %.0f MiB at most.' % (
        timing['real_time_factor'], 1000 * timing['cpu_seconds'] / r['frames']['total'], timing['peak_memory_mib'])
    if loop:
        text += ' `corridor_loop` at the camera\'s pace, mapping on its own thread: %.1f ms a frame (p99 %.1f), %d images dropped%s.' % (
            loop['all']['p50'], loop['all']['p99'], loop['dropped'],
            '; p99 %.1f before the first loop, %.1f while one is closed' % (loop['before_the_first_loop']['p99'], loop['closing_a_loop']['p99'])
            if loop['closing_a_loop']['frames'] else '')
    endurance = results.first('endurance')
    if endurance:
        text += ' An hour of localisation: the median frame takes %.1f ms at first and %.1f ms in the end.' % (
            endurance['p50_first_ms'], endurance['p50_last_ms'])
    return section('Speed', text + growth_text(results), run_table(results, room - 6) or stage_table(timing['stages_ms'], room - 7))
