"""The screen of the monitor, by Textual; it redraws only what has changed, once a second."""
import time

from rich.text import Text
from ssi_ros.monitor.words import (
    gap_lines, head_line, health_lines, mode_lines, sketch_lines, summary_line)
from textual.app import App
from textual.containers import Horizontal, VerticalScroll
from textual.widgets import Footer, Static

PERIOD_S = 1.0
STYLES = (('ERROR', 'bold red'), ('STALE', 'bold red'), ('SILENT', 'bold red'),
          ('WARN', 'bold yellow'))


class Screen(App):
    """
    Show a watch.

    Parameters
    ----------
    latest : callable
        Returns the Watch of this moment.

    """

    TITLE = 'ssi_ros monitor'
    BINDINGS = [('q', 'quit', 'quit'), ('p', 'pause', 'pause the screen'),
                ('d', 'details', 'modes / gap and health')]
    CSS = """
    #head { height: 1; text-style: bold reverse; }
    .box { border: round $primary; padding: 0 1; height: auto; }
    #upper { height: 1fr; }
    #modes_box { width: 86; }
    #side { width: 1fr; }
    .-narrow #upper { layout: vertical; }
    .-narrow #modes_box, .-narrow #side { width: 100%; height: 1fr; }
    #summary { height: 1; display: none; }
    .-short #summary { display: block; }
    .-short #sketch { display: none; }
    .-short .box { border: none; padding: 0; }
    .-short.-narrow #side { display: none; }
    .-short.-narrow.details #side { display: block; }
    .-short.-narrow.details #modes_box { display: none; }
    """
    VERTICAL_BREAKPOINTS = [(0, '-short'), (40, '-tall')]       # 80 x 24 has room for the modes
    HORIZONTAL_BREAKPOINTS = [(0, '-narrow'), (130, '-wide')]
    ENABLE_COMMAND_PALETTE = False
    animation_level = 'none'        # nothing moves that does not change

    def __init__(self, latest):
        super().__init__()
        self.latest, self.paused, self.shown = latest, False, {}

    def compose(self):
        """Lay out the panels."""
        yield Static(id='head')
        with Horizontal(id='upper'):
            with VerticalScroll(id='modes_box'):
                yield self._panel('modes', 'modes, ± one standard deviation')
            with VerticalScroll(id='side'):
                yield self._panel('gap', 'gap to the model')
                yield self._panel('health', 'health')
        yield self._panel('sketch', 'stabilisation over the last windows, the latest on top: '
                          '● structural ○ undecided ◆ input line')
        yield Static(id='summary')
        yield Footer()

    def _panel(self, name, title):
        panel = Static(id=name, classes='box')
        panel.border_title = title
        return panel

    def on_mount(self):
        """Begin to look."""
        self.look()
        self.set_interval(PERIOD_S, self.look)

    def action_pause(self):
        """Hold the screen still, or let it go on."""
        self.paused = not self.paused
        self.look()

    def action_details(self):
        """Show gap and health in place of the modes, where there is no room for both."""
        self.screen.toggle_class('details')

    def look(self):
        """Redraw the panels whose text has changed."""
        if self.paused:
            self._show('head', 'PAUSED: p goes on')
            return
        watch = self.latest()
        self._show('head', head_line(watch, time.monotonic()))
        self._show('summary', summary_line(watch))
        columns = max(30, self.size.width - 14)
        for name, lines in (('modes', mode_lines(watch)), ('gap', gap_lines(watch)),
                            ('health', health_lines(watch)),
                            ('sketch', sketch_lines(watch, columns, 8))):
            self._show(name, '\n'.join(lines))

    def _show(self, name, text):
        if self.shown.get(name) == text:
            return
        self.shown[name] = text
        styled = Text(text, no_wrap=name in ('modes', 'sketch'))
        for word, style in STYLES:
            styled.highlight_words([word], style)
        self.query_one(f'#{name}', Static).update(styled)
