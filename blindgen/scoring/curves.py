# Licensed under the Apache License, Version 2.0.
"""Psychometric curves, pooled and by effect, and what a stated probability is worth."""
from blindgen.verify import wilson
import numpy as np

CURVES = {'detected': 'alarm', 'strict': 'strict', 'class': 'right'}
# dashed and on top where nothing but a class separates the last two
STYLES = ({'color': 'C0', 'marker': 'o'}, {'color': 'C3', 'marker': 'x', 'ls': '--', 'zorder': 3},
          {'color': 'C2', 'marker': 'o'})


def curves(rows):
    """
    Return {'pooled' or effect: {curve: {size: share}}} of the cases with one library effect.

    A case counts at the power of two nearest to the d' it reached, which may be less than the one
    it was made for. No effect at all is d' = 0 of the pooled detection: the false alarms.
    """
    singles = [r for r in rows if r['kind'] == 'single']
    sets = {'pooled': singles}
    for row in singles:
        sets.setdefault(row['true'][0], []).append(row)
    data = {name: {curve: _by_size(some, key) for curve, key in CURVES.items()}
            for name, some in sorted(sets.items())}
    none = [r for r in rows if r['kind'] == 'none']
    data['pooled']['detected'] = {'0': wilson(sum(r['alarm'] for r in none), len(none)),
                                  **data['pooled']['detected']}
    return data


def _by_size(rows, key):
    sizes = [float(2.0 ** np.round(np.log2(max(r['d'], 0.25)))) for r in rows]
    return {f'{size:g}': wilson(sum(r[key] for r, s in zip(rows, sizes) if s == size),
                                sizes.count(size)) for size in sorted(set(sizes))}


def draw(data, path):
    """Draw the curves as one PNG: the pooled ones large, each effect small."""
    import matplotlib
    matplotlib.use('Agg')
    from matplotlib import pyplot
    names = [name for name in data if name != 'pooled']
    rows = -(-len(names) // 5)
    figure = pyplot.figure(figsize=(14, 4 + 2 * rows), layout='constrained')
    grid = figure.add_gridspec(rows + 2, 5)
    for k, name in enumerate(['pooled', *names]):
        axes = figure.add_subplot(grid[:2, :] if k == 0 else grid[2 + (k - 1) // 5, (k - 1) % 5])
        for (curve, shares), style in zip(data[name].items(), STYLES):
            shares = {max(float(d), 0.2): s for d, s in shares.items() if s['total']}
            d, value = list(shares), np.array([s['value'] for s in shares.values()])
            ends = np.array([[v - s['low95'], s['high95'] - v]
                             for v, s in zip(value, shares.values())]).reshape(-1, 2).T
            axes.errorbar(d, value, yerr=np.abs(ends) if k == 0 else None, ms=4, capsize=3,
                          label=curve, **style)
        axes.set(xscale='log', ylim=(-0.05, 1.05), xlim=(0.17, 48))
        axes.set_title(name, fontsize=12 if k == 0 else 8)
        axes.set_xticks([0.5, 2, 8, 32], ['0.5', '2', '8', '32'])
        if k == 0:
            axes.set(xlabel="attainable d'; leftmost: no effect", ylabel='share of cases, 95 %')
            axes.legend()
    figure.savefig(path, dpi=80)
    pyplot.close(figure)


def draw_confidence(scores, path):
    """Draw how often a stated probability comes true, and the risk against coverage."""
    import matplotlib
    matplotlib.use('Agg')
    from matplotlib import pyplot
    figure, (left, right) = pyplot.subplots(1, 2, figsize=(9, 4), layout='constrained')
    bins = scores['reliability']
    left.plot([0, 1], [0, 1], color='0.7')
    left.scatter([b['mean'] for b in bins], [b['right'] for b in bins],
                 s=[10 + 2 * b['total'] for b in bins])
    left.set(xlabel='probability stated', ylabel='share right', xlim=(0, 1.02), ylim=(0, 1.02),
             title='reliability; an area counts cases')
    risk = sorted((int(k), v) for k, v in scores['risk_coverage'].items())
    right.plot([k / 100 for k, _ in risk], [v for _, v in risk], marker='o')
    right.set(xlabel='share answered, most confident first', ylabel='share wrong', xlim=(0, 1.02),
              ylim=(0, None), title='risk against coverage')
    figure.savefig(path, dpi=80)
    pyplot.close(figure)
