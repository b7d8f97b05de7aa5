"""How the pictures look: one ink, markers before colours, places fixed in inches."""

INK = '#173f5f'          # dark enough to stand out in grey
PLAIN = {'font.size': 9, 'axes.spines.top': False, 'axes.spines.right': False,
         'svg.hashsalt': 'ssi_ros', 'axes.titlesize': 9,
         'text.parse_math': False}       # a $ in the name of a channel is a $


def panels(rows, columns, size, gap=(0.5, 0.5), margin=(0.75, 0.2, 0.7, 0.55), **options):
    """
    Return a figure and its panels, each of the same size.

    Matplotlib's own layout engines draw everything twice to find the places; twenty panels take
    seconds. Here they are given.

    Parameters
    ----------
    rows, columns : int
        Panels.
    size, gap : (float, float)
        Width and height of a panel and of the space between two [inch].
    margin : (float, float, float, float)
        Left, right, top and bottom [inch].
    **options
        Of `Figure.subplots`.

    Returns
    -------
    figure : matplotlib.figure.Figure
    axes : list of Axes
        Row by row.

    """
    from matplotlib.figure import Figure
    left, right, top, bottom = margin
    width = left + columns * size[0] + (columns - 1) * gap[0] + right
    height = top + rows * size[1] + (rows - 1) * gap[1] + bottom
    figure = Figure(figsize=(width, height))
    axes = figure.subplots(rows, columns, squeeze=False, **options, gridspec_kw={
        'left': left / width, 'right': 1.0 - right / width, 'top': 1.0 - top / height,
        'bottom': bottom / height, 'wspace': gap[0] / size[0], 'hspace': gap[1] / size[1]})
    return figure, list(axes.flat)


def caption(ax, text):
    """Put a title at a fixed place; a floating one costs more time than the curves."""
    ax.set_title(text, y=1.02)
    for axis in (ax.xaxis, ax.yaxis):
        if not axis.get_label().get_text():
            axis.set_label_coords(0.5, 0.5)


def heading(figure, text):
    """Put the title of a whole figure at its upper edge."""
    figure.text(0.5, 1.0 - 0.08 / figure.get_figheight(), text, fontsize=10, ha='center',
                va='top')


def foot(figure, text):
    """Put the words below all panels."""
    figure.text(0.5, 0.1 / figure.get_figheight(), text, fontsize=9, ha='center', va='bottom')
