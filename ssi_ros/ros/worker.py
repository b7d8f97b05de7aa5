"""Run long work in a process of its own, so that whoever asked goes on with its own work."""
import multiprocessing
import os
import signal
import threading
import traceback


class Background:
    """
    One piece of work at a time, in another process.

    `poll` says how far it is and returns the answer when it has come.

    Parameters
    ----------
    niceness : int
        By how much the process gives way to others.

    """

    def __init__(self, niceness=0):
        self.niceness = niceness
        self.process = self.pipe = self._launch = None
        self.share = 0.0

    @property
    def busy(self):
        """Whether work runs."""
        return self._launch is not None

    def start(self, work, *args, **options):
        """Begin `work(*args, **options, progress=callable)`; all of it must be picklable."""
        # a forked child would inherit the locks of a node's threads
        context = multiprocessing.get_context('spawn')
        self.pipe, theirs = context.Pipe(duplex=False)
        self.process = context.Process(target=_work, daemon=True,
                                       args=(theirs, self.niceness, work, args, options))
        self.share = 0.0
        # it returns when the child has read its arguments, which takes seconds
        self._launch = threading.Thread(target=self._start, args=(self.process, theirs),
                                        daemon=True)
        self._launch.start()

    @staticmethod
    def _start(process, theirs):
        process.start()
        theirs.close()      # so that the end of the child is the end of the pipe

    def poll(self):
        """Return ('done', result) or ('failed', why) when the work has ended, else None."""
        answer = None
        try:
            while answer is None and self.pipe.poll():
                kind, value = self.pipe.recv()
                if kind == 'share':
                    self.share = value
                else:
                    answer = (kind, value)
        except EOFError:
            self._launch.join()
            self.process.join()
            answer = ('failed', f'its process ended with exit code {self.process.exitcode}; was '
                      'it killed, or is memory short?')
        if answer is not None:
            self.stop()
        return answer

    def stop(self):
        """End the process if it still runs."""
        if self._launch is not None:
            self._launch.join()
            self.process.terminate()
            self.process.join()
            self.pipe.close()
            self.process = self.pipe = self._launch = None


def diagnose_to_json(spacecraft, samples, settings, *, present=(), inputs=None, **options):
    """Return `diagnose(...)` as the plain data of its JSON form."""
    from ssi_ros.gap.driver import diagnose
    from ssi_ros.gap.nominal.model import ModelNominal
    return diagnose(ModelNominal(spacecraft, present, inputs), samples, settings,
                    **options).to_json()


def _work(pipe, niceness, work, args, options):
    """Work in the child; tell how far it is, then the answer."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)       # the parent decides when to end
    os.nice(niceness)
    try:
        from threadpoolctl import threadpool_limits
        with threadpool_limits(limits=1):
            result = work(*args, **options,
                          progress=lambda share: pipe.send(('share', float(share))))
        pipe.send(('done', result))
    except (ValueError, OSError) as error:
        pipe.send(('failed', str(error)))
    except Exception:
        pipe.send(('failed', 'a fault of this program:\n' + traceback.format_exc()))
