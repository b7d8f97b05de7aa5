"""Stabilisation diagram and singular values of one window."""
from ssi_ros.identify.plot_style import heading, INK, panels

KINDS = (        # (words of the reason, legend, marker, colour)
    ('only from order', 'only beyond the significant orders', '^', '#b8860b'),
    ('orders;', 'not in enough orders', 'x', '#8c8c8c'),
    ('spread', 'spread too wide', 's', '#7b6fa8'),
    ('collinear', 'shape not collinear', 'D', '#5b8c5a'),
    ('damping', 'damping out of range', '+', '#b05a5a'),
    ('', 'another band, or other reasons', '.', '#bdbdbd'),
)


def kind_of(pole):
    """Return (legend, marker, colour) of a rejected pole."""
    return next(k[1:] for k in KINDS if k[0] in pole.reason)


def shown(window):
    """Return the rejected poles worth drawing: those of a band that answers for them."""
    return [p for p in window.rejected if p.order and not p.reason.startswith('outside')]


def accepted(window):
    """Return the poles that became modes."""
    return [p for band in getattr(window, 'bands', ()) for p in band.accepted]


def stabilisation(window, spectrum):
    """Draw the poles of all orders over frequency, and the spectrum below them."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
    rows = 2 if spectrum else 1
    figure, axes = panels(rows, 1, (10.0, 2.4), (0.0, 0.15), (0.8, 0.2, 1.0, 1.0), sharex=True,
                          height_ratios=[3, 1.3][:rows])
    groups = {}
    for p in shown(window):
        groups.setdefault(kind_of(p), []).append(p)
    for _, legend, marker, colour in KINDS:
        poles = groups.get((legend, marker, colour))
        if poles:
            axes[0].plot([p.frequency_hz for p in poles], [p.order for p in poles], marker,
                         color=colour, markersize=4.5, linestyle='',
                         label=f'left out: {legend} ({len(poles)})')
    good = accepted(window)
    axes[0].plot([p.frequency_hz for p in good], [p.order for p in good], 'o', color=INK,
                 markersize=4.0, label=f'pole of a mode ({len(good)})')
    top = max((p.order for p in [*good, *shown(window)]), default=10)
    for mode in window.modes:
        for ax in axes:
            ax.axvline(mode.frequency_hz, color=INK, linewidth=0.6, alpha=0.5, zorder=0,
                       linestyle='-' if mode.label == 'structural' else '--')
    for frequency, text, share in _spaced(window.modes):
        axes[0].annotate(text, (frequency, top + 1.5), (share, 1.06),
                         textcoords=axes[0].transAxes, rotation=90, fontsize=7, ha='center',
                         va='bottom',
                         arrowprops={'arrowstyle': '-', 'linewidth': 0.4, 'color': INK,
                                     'relpos': (0.5, 0.0)})
    axes[0].set_ylim(0, top + 1.5)
    axes[0].set_ylabel('model order')
    if groups or good:
        figure.legend(loc='lower center', ncols=4, fontsize=8)
    axes[-1].set_xscale('log')
    axes[-1].xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes[-1].xaxis.set_major_formatter(FuncFormatter(lambda x, _: f'{x:g}'))
    axes[-1].xaxis.set_minor_formatter(NullFormatter())
    axes[-1].set_xlabel('frequency [Hz]')
    low, high = _range(window, spectrum)
    axes[-1].set_xlim(low, high)
    if spectrum:
        axes[1].plot(*spectrum, color='black', linewidth=0.7)
        axes[1].set_ylabel('mean spectrum\n[dB over 1/Hz]')
    heading(figure, 'Stabilisation diagram of the last window, its modes above'
            + (f'\n{window.reason}' if window.reason else ''))
    return figure


def _range(window, spectrum):
    every = [p.frequency_hz for p in [*accepted(window), *shown(window), *window.modes]]
    if spectrum:
        every.append(spectrum[0][-1])
    return (0.8 * min(every), 1.1 * max(every)) if every else (0.1, 10.0)


def _spaced(modes):
    """Yield (frequency, text, share of the width): labels in a row that do not overlap."""
    for k, mode in enumerate(modes):
        mark = {'structural': '', 'input_line': ' line', 'undecided': ' ?'}[mode.label]
        yield mode.frequency_hz, f'{mode.frequency_hz:.3f}{mark}', (k + 0.5) / len(modes)


def singular_values(window):
    """Draw the singular values of every band and what noise alone reaches."""
    figure, (ax,) = panels(1, 1, (7.0, 3.2), margin=(0.8, 0.2, 0.4, 0.5))
    for band, marker, colour in zip(getattr(window, 'bands', ()), 'osD^vx+*',
                                    (INK, '#b8860b', '#7b6fa8', '#5b8c5a') * 2):
        values = band.singular_values
        ax.plot(range(1, len(values) + 1), values, marker, color=colour, markersize=4,
                linestyle='', label=f'band of {band.rate_hz:g} Hz: '
                f'{int((values > band.floor).sum())} above the noise')
        ax.axhline(band.floor, color=colour, linewidth=0.8, linestyle='--')
    ax.set_yscale('log')
    ax.set_xlabel('number (two of them make a mode)')
    ax.set_ylabel('singular value')
    heading(figure, 'Singular values of the last window; dashed: what noise alone reaches')
    if ax.has_data():
        ax.legend(fontsize=8)
    return figure
