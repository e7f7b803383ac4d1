"""What run_random prints and draws of its measurements, and the section Random worlds of BENCHMARK.md."""
import math
import statistics

from page_parts import metres, percent, section, table

RUNS = ('laser', 'no laser', 'visual')
LEAST_COVERAGE = 0.9  # of the drive; a run with poses for less of it counts as worse than odometry alone
# run -> bar: of the median ATE / odometry alone, and of the share of worlds that are worse
RATIO_BARS = {'laser': 0.10, 'no laser': 0.25}
WORSE_BARS = {'laser': 1 / 60, 'no laser': 3 / 60}


def metric(run):
    return run.get('metric', False) and 'ate' in run


def worse(world, run):
    """Than odometry alone, by more than 2 mm and 5 %; or hardly any poses."""
    if not metric(run) or run['coverage'] < LEAST_COVERAGE:
        return True
    return run['ate'] > world['odometry'] + 0.002 and run['ate'] > 1.05 * world['odometry']


def ratio(world, run):
    return run['ate'] / world['odometry']


def number(value, form):
    return '-' if value is None else form % value


def dig(run, *keys):
    for key in keys:
        if run is None:
            return None
        run = run.get(key)
    return run


HEAD = ('%5s %-9s %5s %-8s %-9s %8s %8s %8s %6s  %7s %6s  %6s %5s %6s %5s  %5s %5s  %3s/%-3s %5s %5s %6s %5s  %s' % (
    'seed', 'kind', 'm', 'size', 'run', 'odometry', 'ATE', 'live', 'ratio', 'scale %', '/sigma', 'NEES', 'in %', 'final', 'in %', 'odo %', 'lost%',
    'sl', 'made', 'prec', 'rec', 'wr.occ', 'CPU s', 'remarks'))


def remarks(world, name, run):
    words = []
    if name != 'visual' or metric(run):
        words += ['worse than odometry'] if worse(world, run) else []
    if not metric(run):
        words.append('no scale')
    if run.get('coverage', 0.0) < LEAST_COVERAGE:
        words.append('poses for %.0f %%' % (100 * run.get('coverage', 0.0)))
    if run.get('ends_lost'):
        words.append('ends lost')
    return ', '.join(words)


def row(world, name):
    run = world['runs'].get(name)
    if run is None:
        return None
    start = '%5d %-9s %5.0f %-8s %-9s %8.4f' % (world['seed'], world['kind'], world['length'], world['size'], name, world['odometry'])
    if 'failed' in run:
        return start + '  ' + run['failed']
    percent = lambda value: None if value is None else 100 * value
    scaled = metric(run)
    return start + ' %8s %8s %6s  %7s %6s  %6s %5s %6s %5s  %5.1f %5.1f  %3d/%-3d %5s %5s %6s %5.0f  %s' % (
        number(run.get('ate'), '%.4f'), number(run.get('live'), '%.4f'), number(ratio(world, run) if scaled else None, '%.2f'),
        number(percent(run.get('scale_error')) if scaled else None, '%+.2f'), number(run['scale_error'] / run['sigma'] if scaled else None, '%+.1f'),
        number(dig(run, 'live_honesty', 'nees'), '%.1f'), number(percent(dig(run, 'live_honesty', 'within_95')), '%.0f'),
        number(dig(run, 'final_honesty', 'nees'), '%.1f'), number(percent(dig(run, 'final_honesty', 'within_95')), '%.0f'),
        100 * run['odometry_share'], 100 * run['lost_share'], run['slips'], world['slips'], number(dig(run, 'grid', 'precision'), '%.2f'),
        number(dig(run, 'grid', 'recall'), '%.2f'), number(dig(run, 'grid', 'wrong_occupied'), '%.3f'), run['cpu_seconds'], remarks(world, name, run))


def honesty(runs, which):
    """Over worlds: mean NEES, its median, and the share of worlds where 93 % of the poses are within their 95 %."""
    found = [r[which] for r in runs if dig(r, which)]
    if not found:
        return None
    return {'mean': statistics.mean(h['nees'] for h in found), 'median': statistics.median(h['nees'] for h in found), 'worst': max(h['nees'] for h in found),
            'worlds_covered': sum(h['within_95'] >= 0.93 for h in found) / len(found)}


def summary_of(worlds, name):
    pairs = [(w, w['runs'][name]) for w in worlds if name in w['runs']]
    good = [(w, r) for w, r in pairs if metric(r)]
    values = {'worlds': len(pairs), 'metric': len(good), 'failed': sum('failed' in r for _, r in pairs),
              'ends_lost': sum(bool(r.get('ends_lost')) for _, r in pairs),
              'worse': [w['seed'] for w, r in pairs if (name != 'visual' or metric(r)) and worse(w, r)]}
    if not good:
        return values
    runs = [r for _, r in good]
    grids = [r['grid'] for r in runs if r.get('grid')]
    worst = {'precision': min, 'recall': min, 'of_sight': min, 'wrong_occupied': max}
    for grid in grids:  # of what a perfect range sensor would have seen
        grid['of_sight'] = grid['recall'] / max(grid['in_sight'], 1e-9)
    values.update(
        ratio={'median': statistics.median(ratio(w, r) for w, r in good), 'worst': max(ratio(w, r) for w, r in good)},
        ate=statistics.median(r['ate'] for r in runs), live=statistics.median(r['live'] for r in runs),
        odometry=statistics.median(w['odometry'] for w, _ in good),
        scale_rms=math.sqrt(statistics.mean((r['scale_error'] / r['sigma']) ** 2 for r in runs)),
        scale_error=statistics.median(abs(r['scale_error']) for r in runs),
        live_honesty=honesty(runs, 'live_honesty'), final_honesty=honesty(runs, 'final_honesty'),
        odometry_share=statistics.mean(r['odometry_share'] for r in runs), lost_share=statistics.mean(r['lost_share'] for r in runs),
        slips={'counted': sum(r['slips'] for r in runs), 'made': sum(w['slips'] for w, _ in good)},
        grids={f: {'median': statistics.median(g[f] for g in grids), 'worst': worst[f](g[f] for g in grids)} for f in worst} if grids else {},
        cpu_seconds=sum(r['cpu_seconds'] for r in runs))
    return values


def mark(value, low, high):
    return ' ' if low <= value <= high else '!'


def print_summary(name, s):
    print('\n%s: %d worlds, metric in %d, %d crashed or hung, %d end lost' % (name, s['worlds'], s['metric'], s['failed'], s['ends_lost']))
    missed = name in WORSE_BARS and len(s['worse']) > WORSE_BARS[name] * s['worlds']
    bar = '   (<= %.0f of 60)' % (60 * WORSE_BARS[name]) if name in WORSE_BARS else ''
    print('  worse than odometry alone   %d of %d%s%s%s' % (
        len(s['worse']), s['worlds'], '!' if missed else ' ', ' seeds ' + ' '.join(map(str, s['worse'])) if s['worse'] else '', bar))
    if not s['metric']:
        return
    bar = RATIO_BARS.get(name)
    print('  ATE / odometry alone        median %.3f%s worst %.2f%s' % (
        s['ratio']['median'], mark(s['ratio']['median'], 0, bar) if bar else ' ', s['ratio']['worst'], '   (median <= %.2f)' % bar if bar else ''))
    print('  ATE, medians                final %.4f m, live %.4f m, odometry alone %.3f m' % (s['ate'], s['live'], s['odometry']))
    print('  scale                       |error| median %.2f %%, RMS of error / sigma %.2f%s  (0.7 to 1.4)' % (
        100 * s['scale_error'], s['scale_rms'], mark(s['scale_rms'], 0.7, 1.4)))
    for which, label in (('live_honesty', 'NEES of live poses '), ('final_honesty', 'NEES of final poses')):
        h = s[which]
        if h:
            print('  %s         mean %.1f%s median %.1f worst %.1f; 93 %% of poses within 95 %% in %.0f %% of worlds%s  (2 to 5; >= 90 %%)' % (
                label, h['mean'], mark(h['mean'], 2, 5), h['median'], h['worst'], 100 * h['worlds_covered'], mark(h['worlds_covered'], 0.9, 1)))
    print('  images                      on odometry %.1f %%, lost %.1f %%' % (100 * s['odometry_share'], 100 * s['lost_share']))
    print('  slips                       %d counted, %d made' % (s['slips']['counted'], s['slips']['made']))
    if s['grids']:
        print('  fused grids                 ' + ', '.join('%s %.3f (worst %.3f)' % (f, v['median'], v['worst']) for f, v in s['grids'].items()) +
              '  (>= 0.95, >= 0.80, -, <= 0.015)')
    print('  cost                        %.0f CPU s' % s['cpu_seconds'])


def print_kinds(worlds):
    print('\n%-10s %-9s %6s %13s %12s %10s %10s %6s' % ('kind', 'run', 'worlds', 'ratio: median', 'worst', 'scale/sig', 'NEES live', 'worse'))
    for kind in dict.fromkeys(w['kind'] for w in worlds):
        own = [w for w in worlds if w['kind'] == kind]
        for name in RUNS:
            s = summary_of(own, name)
            if not s['metric']:
                continue
            print('%-10s %-9s %6d %13.3f %12.2f %10.2f %10s %6d' % (
                kind, name, s['worlds'], s['ratio']['median'], s['ratio']['worst'], s['scale_rms'],
                number(dig(s, 'live_honesty', 'mean'), '%.1f'), len(s['worse'])))


# --- BENCHMARK.md -------------------------------------------------------------------------------------------------------


def bold(text, missed):
    return '**%s**' % text if missed else text


def honesty_cell(s, which):
    h = s.get(which)
    if not h:
        return '-'
    return '%s, %.1f; %s' % (bold('%.1f' % h['mean'], not 2 <= h['mean'] <= 5), h['worst'],
                             bold('%.0f %%' % (100 * h['worlds_covered']), h['worlds_covered'] < 0.9))


def grid_cell(s, figure, bar):
    g = s.get('grids', {}).get(figure)
    if not g:
        return '-'
    return '%s, %.3f' % (bold('%.3f' % g['median'], g['median'] > bar if figure == 'wrong_occupied' else g['median'] < bar), g['worst'])


def random_worlds(results):
    record = results.first('random')
    if not record:
        return []
    summaries = {name: record['summary'][name] for name in RUNS if name in record['summary']}
    over = lambda name, value, bars: name in bars and value > bars[name]
    lines = [
        ('ATE / odometry alone: median, worst', '0.10; without 0.25', lambda n, s: '%s, %.2f' % (
            bold('%.3f' % s['ratio']['median'], over(n, s['ratio']['median'], RATIO_BARS)), s['ratio']['worst'])),
        ('ATE; as published; odometry alone: medians (m)', '', lambda n, s: '; '.join(metres(s[k]) for k in ('ate', 'live', 'odometry'))),
        ('worse than odometry alone', '1 of 60; without 3', lambda n, s: bold('%d of %d' % (len(s['worse']), s['worlds']),
                                                                            over(n, len(s['worse']) / s['worlds'], WORSE_BARS))),
        ('scale: error, median; RMS of error / sigma', '0.7 to 1.4', lambda n, s: '%s; %s' % (
            percent(s['scale_error']), bold('%.2f' % s['scale_rms'], not 0.7 <= s['scale_rms'] <= 1.4))),
        ('NEES as published: mean, worst; worlds with 93 % of poses within 95 %', '2 to 5; 90 %', lambda n, s: honesty_cell(s, 'live_honesty')),
        ('NEES of final poses: the same', '', lambda n, s: honesty_cell(s, 'final_honesty')),
        ('images on odometry; lost', '', lambda n, s: '%s; %s' % (percent(s['odometry_share'], 1), percent(s['lost_share'], 1))),
        ('ends lost; crashed or hung; without scale', '0; 0', lambda n, s: '%d; %d; %d' % (s['ends_lost'], s['failed'], s['worlds'] - s['metric'])),
        ('slips counted; made', '', lambda n, s: '%d; %d' % (s['slips']['counted'], s['slips']['made'])),
        ('fused grids: precision, median, worst', '0.95', lambda n, s: grid_cell(s, 'precision', 0.95)),
        ('recall', '0.80', lambda n, s: grid_cell(s, 'recall', 0.80)),
        ('wrong occupied', '0.015', lambda n, s: grid_cell(s, 'wrong_occupied', 0.015))]
    rows = [[what, bar] + [show(name, s) if s['metric'] else '-' for name, s in summaries.items()] for what, bar, show in lines]
    names = {'laser': 'with the laser', 'no laser': 'without', 'visual': 'visual start'}
    return section('Random worlds', '`bench/accuracy/run_random --seeds %d-%d`: [worlds that nobody designed](docs/random_worlds.md), of seeds that nothing '
                   'was chosen by ([CONTRIBUTING](CONTRIBUTING.md#seeds)).' % tuple(record['seeds']),
                   table(['over the worlds', 'bar'] + [names[name] for name in summaries], rows))


# --- the picture --------------------------------------------------------------------------------------------------------

COLOURS = {'laser': '#1f77b4', 'no laser': '#d95f02', 'visual': '#7a7a7a'}
SIZE, MARGIN = 460, 56  # px
LOW, HIGH = 1e-3, 30.0  # m, of both axes


def place(value):
    share = (math.log(min(HIGH, max(LOW, value))) - math.log(LOW)) / (math.log(HIGH) - math.log(LOW))
    return share * SIZE


def scatter(worlds):
    """Ours against odometry alone, on logarithmic axes, as the text of an SVG file."""
    x, y = lambda v: MARGIN + place(v), lambda v: MARGIN + SIZE - place(v)
    parts = ['<svg xmlns="http://www.w3.org/2000/svg" width="%d" height="%d" font-family="sans-serif" font-size="12">' % ((SIZE + 2 * MARGIN,) * 2),
             '<rect width="100%" height="100%" fill="white"/>']
    for tick in (0.001, 0.01, 0.1, 1.0, 10.0):
        parts.append('<path d="M%.1f %.1fV%.1fM%.1f %.1fH%.1f" stroke="#ddd"/>' % (x(tick), y(LOW), y(HIGH), x(LOW), y(tick), x(HIGH)))
        parts.append('<text x="%.1f" y="%.1f" text-anchor="middle">%g</text>' % (x(tick), y(LOW) + 16, tick))
        parts.append('<text x="%.1f" y="%.1f" text-anchor="end">%g</text>' % (x(LOW) - 5, y(tick) + 4, tick))
    for factor in (1.0, 0.1):
        ends = [(v, v * factor) for v in (LOW / min(1.0, factor), HIGH)]
        parts.append('<path d="M%.1f %.1fL%.1f %.1f" stroke="#999" stroke-dasharray="%s"/>' % (
            x(ends[0][0]), y(ends[0][1]), x(ends[1][0]), y(ends[1][1]), 'none' if factor == 1.0 else '5 4'))
    for number_of, name in enumerate(RUNS):
        shown = [(w, w['runs'][name]) for w in worlds if metric(w['runs'].get(name, {}))]
        for world, run in shown:
            parts.append('<circle cx="%.1f" cy="%.1f" r="4" fill="%s" fill-opacity="0.7"><title>%s %d, %s: %.4f m, odometry alone %.4f m</title></circle>' % (
                x(world['odometry']), y(run['ate']), COLOURS[name], world['kind'], world['seed'], name, run['ate'], world['odometry']))
        parts.append('<circle cx="%d" cy="%d" r="4" fill="%s"/><text x="%d" y="%d">%s (%d)</text>' % (
            MARGIN + 14, MARGIN + 14 + 18 * number_of, COLOURS[name], MARGIN + 24, MARGIN + 18 + 18 * number_of, name, len(shown)))
    parts.append('<text x="%d" y="%d" text-anchor="middle">ATE of odometry alone (m)</text>' % (MARGIN + SIZE / 2, 2 * MARGIN + SIZE - 16))
    parts.append('<text transform="translate(16 %d) rotate(-90)" text-anchor="middle">ATE of the final map (m)</text>' % (MARGIN + SIZE / 2))
    return '\n'.join(parts + ['</svg>', ''])
