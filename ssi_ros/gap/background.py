"""Diagnose in a process of its own, so that whoever asked goes on with its work."""
import multiprocessing
import os
import signal
import traceback

NICENESS = 5


class Background:
    """
    One diagnosis at a time, in another process.

    `poll` says how far it is and returns the answer when it has come.
    """

    def __init__(self):
        self.process = self.pipe = None
        self.share = 0.0

    @property
    def busy(self):
        """Whether a diagnosis runs."""
        return self.process is not None

    def start(self, spacecraft, samples, settings, **options):
        """Begin `diagnose(spacecraft, samples, settings, **options)`."""
        # a forked child would inherit the threads' locks of a node
        context = multiprocessing.get_context('spawn')
        self.pipe, theirs = context.Pipe(duplex=False)
        self.process = context.Process(target=_work, daemon=True, args=(
            theirs, spacecraft, samples, settings, options))
        self.share = 0.0
        self.process.start()
        theirs.close()

    def poll(self):
        """Return ('done', plain JSON data) or ('failed', why) when it has ended, else None."""
        answer = None
        try:
            while answer is None and self.pipe.poll():
                kind, value = self.pipe.recv()
                if kind == 'share':
                    self.share = value
                else:
                    answer = (kind, value)
        except EOFError:
            self.process.join()
            answer = ('failed', 'the process of the diagnosis ended with exit code '
                      f'{self.process.exitcode}; was it killed, or is memory short?')
        if answer is not None:
            self.stop()
        return answer

    def stop(self):
        """End the process if it still runs."""
        if self.process is not None:
            self.process.terminate()
            self.process.join()
            self.pipe.close()
            self.process = self.pipe = None


def _work(pipe, spacecraft, samples, settings, options):
    """Diagnose in the child; tell how far it is, then the answer."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)       # the parent decides when to end
    os.nice(NICENESS)
    try:
        from ssi_ros.gap.diagnose import diagnose
        from threadpoolctl import threadpool_limits
        with threadpool_limits(limits=1):
            found = diagnose(spacecraft, samples, settings, **options,
                             progress=lambda share: pipe.send(('share', float(share))))
        pipe.send(('done', found.to_json()))
    except ValueError as error:
        pipe.send(('failed', str(error)))
    except Exception:
        pipe.send(('failed', 'a fault of the diagnosis:\n' + traceback.format_exc()))
