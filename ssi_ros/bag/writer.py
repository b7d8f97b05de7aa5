"""Write a bag in rosbag2's layout: flushed and synced beside the caller, split, closed whole."""
from array import array
from dataclasses import replace
import errno
from pathlib import Path
import queue
import threading
import time

from .definitions import definition_of, type_hash_of
from .layout import channel_metadata, dump, information, profiles_of, save_information, Topic
from .mcap_file import Block, CHUNK_BYTES, McapFile, MESSAGE_HEAD

_MESSAGE = 5                       # opcode of a message record
_FULL = {errno.ENOSPC, errno.EDQUOT}        # of which there may be an end
_MOST_WAITING = 64 << 20           # bytes handed over and not yet written, before `write` waits


class BagWriter:
    """
    Write messages to a new bag.

    `write` only appends to a buffer (about 1 us). A thread of its own compresses, writes and
    syncs it every `flush_s`, so a slow disk does not hold up the caller; a process that is
    killed loses at most what was written since the last flush.

    Parameters
    ----------
    folder : str or Path
        Folder to make; it must not exist.
    split_bytes : int
        A new file once one has this size [byte]; 0 for never.
    split_s : float
        A new file once one spans this log time [s]; 0 for never.
    compression : str
        'zstd', 'lz4' or 'none'.
    flush_s : float
        Longest time that a message waits in memory [s].
    clock : callable
        Monotonic time [s] by which a flush is due.
    custom_data : dict, optional
        Words to words, kept in metadata.yaml.
    patient : bool
        Leave out what does not fit on a full disk and go on when there is space again; see
        `full` and `dropped`.

    Attributes
    ----------
    full : str
        Why the newest chunk of a patient writer was left out; empty while all is written.
    dropped : int
        Messages that were left out so.

    Raises
    ------
    ValueError
        If the folder exists, or an option is out of range.
    OSError
        From `add_topic`, `write` or `close`: the disk is full or failed. What was written
        before is kept.

    """

    def __init__(self, folder, *, split_bytes=0, split_s=0, compression='zstd', flush_s=0.5,
                 clock=time.monotonic, custom_data=None, patient=False):
        for name, value in (('split_bytes', split_bytes), ('split_s', split_s)):
            if not value >= 0:
                raise ValueError(f'{name}={value} must be 0 (no split) or more')
        if not flush_s > 0:
            raise ValueError(f'flush_s={flush_s} must be a positive time [s]')
        self.folder = Path(folder)
        if self.folder.exists():
            raise ValueError(f'{folder} exists and is never overwritten; name another folder, '
                             'or remove it first')
        self.topics = {}
        self._split_bytes, self._split_ns = split_bytes, round(split_s * 1e9)
        self._compression, self._flush_s, self._clock = compression, flush_s, clock
        self._custom_data, self._patient = custom_data, patient
        self.full, self.dropped, self._late_topics = '', 0, []
        self._ids, self._files, self._counts = {}, [], {}
        self._queue, self._waiting, self._lock = queue.SimpleQueue(), 0, threading.Lock()
        self._failure, self._told, self._closed, self._dirty = None, False, False, False
        self._split_from = None
        self._begin_block()
        self._due = clock() + flush_s
        self.folder.mkdir(parents=True)
        try:
            self._open_file()
        except (ValueError, OSError):
            self.folder.rmdir()
            raise
        self._synced = time.monotonic()
        self._worker = threading.Thread(target=self._work, name='bag_writer', daemon=True)
        self._worker.start()

    def __enter__(self):
        return self

    def __exit__(self, kind, error, trace):
        self.close()

    # The caller's side ----------------------------------------------------------------------

    def add_topic(self, name, type_name, qos=None, *, definition=None, type_hash=None,
                  encoding='cdr'):
        """
        Add a topic before its first message.

        Parameters
        ----------
        name, type_name : str
            Topic and `pkg/msg/Type`.
        qos : Qos, dict or a list of them, optional
            What its publishers offer.
        definition, type_hash : str, optional
            Of the type; taken from the installed one if not given.
        encoding : str
            How its messages are serialised.

        Raises
        ------
        ValueError
            If the topic is there already, or its type is not installed.

        """
        if name in self.topics:
            raise ValueError(f'topic {name} is in the bag already, as '
                             f'{self.topics[name].type}')
        topic = Topic(name, type_name, tuple(profiles_of(qos)),
                      definition_of(type_name) if definition is None else definition,
                      type_hash_of(type_name) if type_hash is None else type_hash, encoding)
        with self._lock:
            self._check()
            self._ids[name] = len(self._ids) + 1
            self.topics[name] = topic
            self._queue.put(topic)

    def write(self, topic, cdr_bytes, log_ns, publish_ns):
        """
        Add one message.

        Parameters
        ----------
        topic : str
            A topic that was added.
        cdr_bytes : bytes
            The message in CDR.
        log_ns, publish_ns : int
            Time of receipt and of publication [ns].

        Raises
        ------
        ValueError
            If the topic was not added, or a time is before 1970.

        """
        channel = self._ids.get(topic)
        if channel is None:
            raise ValueError(f'topic {topic} was not added; the bag has '
                             + (', '.join(self.topics) or 'none') + '; call add_topic first')
        if log_ns < 0 or publish_ns < 0:
            raise ValueError(f'log_ns={log_ns}, publish_ns={publish_ns} must not be negative')
        with self._lock:
            self._check()
            if self._split_ns:
                if self._split_from is None:
                    self._split_from = log_ns
                elif log_ns - self._split_from >= self._split_ns:
                    self._seal()
                    self._queue.put('split')
                    self._split_from = log_ns
            records, index = self._records, self._index.get(channel)
            if index is None:
                index = self._index[channel] = array('Q')
                if self._start_ns is None:
                    self._start_ns = self._end_ns = log_ns
            index.extend((log_ns, len(records)))
            records += MESSAGE_HEAD.pack(_MESSAGE, 22 + len(cdr_bytes), channel, 0, log_ns,
                                         publish_ns)
            records += cdr_bytes
            if log_ns > self._end_ns:
                self._end_ns = log_ns
            elif log_ns < self._start_ns:
                self._start_ns = log_ns
            if len(records) >= CHUNK_BYTES or self._clock() >= self._due:
                self._seal()
        self._wait()

    def note(self, key, words):
        """Put words into the custom data that the metadata will hold, in place of a dict."""
        with self._lock:
            self._custom_data = {**(self._custom_data or {}), key: words}

    def flush_if_due(self):
        """Hand over what waits if a flush is due; the writing thread looks too when idle."""
        with self._lock:
            self._check()
            if self._clock() >= self._due:
                self._seal()

    def write_block(self, block):
        """Add a chunk that is laid out already; its channels are `channel_id(topic)`."""
        with self._lock:
            self._check()
            self._seal()
            self._hand_over(block)
        self._wait()

    def channel_id(self, topic):
        """Return the MCAP channel id of a topic."""
        return self._ids[topic]

    def close(self):
        """
        Write what is left, the summary and metadata.yaml.

        Raises
        ------
        OSError
            If the disk is full or failed, and no `write` has said so yet.

        """
        if self._closed:
            return
        self._closed = True
        with self._lock:
            self._seal()
            self._queue.put(None)
        self._worker.join()
        try:
            if self._file is not None:
                self._close_file()
            save_information(self.folder, self._information())
        except OSError as error:
            if self._file is not None:
                self._file.abandon()
            self._failure = self._failure or error
        if self._failure is not None and not self._told:
            raise self._told_failure()

    def _check(self):
        if self._failure is not None:
            raise self._told_failure()
        if self._closed:
            raise ValueError(f'{self.folder} is closed; open a new bag to write more')

    @property
    def kept(self):
        """Return the number of messages that are in the files."""
        return sum(self._counts.values())

    def _told_failure(self):
        self._told = True
        n = self.kept
        return OSError(self._failure.errno, f'{self._failure.strerror or self._failure}: the '
                       f'{n} messages written before are kept in {self.folder}; free some space'
                       f' and, if the bag does not open, run ssi_ros recover {self.folder}')

    def _wait(self):
        """Let the writing thread catch up, rather than fill the memory."""
        while self._waiting > _MOST_WAITING and self._failure is None:
            time.sleep(0.001)

    def _begin_block(self):
        self._records, self._index, self._start_ns, self._end_ns = bytearray(), {}, None, None

    def _seal(self):
        """Hand the buffer over to the writing thread; the caller holds the lock."""
        self._due = self._clock() + self._flush_s
        if self._records:
            self._hand_over(Block(self._records, {c: p.tobytes() for c, p in self._index.items()},
                                  self._start_ns, self._end_ns))
            self._begin_block()

    def _hand_over(self, block):
        self._waiting += len(block.records)
        self._queue.put(block)

    # The writing thread's side --------------------------------------------------------------

    def _work(self):
        while True:
            try:
                item = self._queue.get(timeout=self._flush_s)
            except queue.Empty:           # the stream has stopped: flush what it left
                with self._lock:
                    self._seal()
                item = 'sync'
            if item is None:
                return
            try:
                if self._failure is None:
                    self._do(item)
                    self.full = '' if isinstance(item, Block) else self.full
            except OSError as error:
                self._refused(item, error)
            if isinstance(item, Block):
                with self._lock:
                    self._waiting -= len(item.records)

    def _refused(self, item, error):
        """Leave out what the disk does not take, if it may take the next; else it has failed."""
        if not (self._patient and error.errno in _FULL and isinstance(item, (Topic, Block))):
            self._failure = error
            return
        self.full = error.strerror
        if isinstance(item, Topic):
            self._late_topics.append(item)
        else:
            self.dropped += sum(item.counts().values())

    def _do(self, item):
        if isinstance(item, Topic):
            self._register(item)
        elif isinstance(item, Block):
            while self._late_topics:
                self._register(self._late_topics[0])
                self._late_topics.pop(0)
            if self._split_bytes and self._file.size >= self._split_bytes and self._file.counts:
                self._next_file()
            self._file.add_block(item)
            for channel, count in item.counts().items():
                self._counts[channel] = self._counts.get(channel, 0) + count
            self._dirty = True
        elif item == 'split':
            self._next_file()
        # A burst of chunks is synced once in flush_s, not chunk by chunk.
        if self._dirty and time.monotonic() - self._synced >= 0.8 * self._flush_s:
            self._file.sync()
            self._dirty, self._synced = False, time.monotonic()

    def _open_file(self):
        name = f'{self.folder.resolve().name}_{len(self._files)}.mcap'
        self._file, self._registered = McapFile(self.folder / name, self._compression), []
        self._file.add_metadata('rosbag2', {
            'serialized_metadata': dump(self._information()).strip()})

    def _register(self, topic):
        schema = self._file.add_schema(topic.type, topic.definition)
        self._file.add_channel(self._ids[topic.name], topic.name, schema,
                               channel_metadata(topic), topic.encoding)
        self._registered.append(topic)

    def _close_file(self):
        file = self._file
        self._files.append((file.path.name, file.start_ns, file.end_ns,
                            sum(file.counts.values())))
        file.add_metadata('rosbag2', {'serialized_metadata': dump(self._information()).strip()})
        file.finish()
        self._file = None

    def _next_file(self):
        topics = self._registered
        self._close_file()
        self._open_file()
        for topic in topics:
            self._register(topic)

    def _information(self):
        topics = [replace(t, count=self._counts.get(self._ids[t.name], 0))
                  for t in list(self.topics.values())]
        return information(topics, self._files, self._custom_data)
