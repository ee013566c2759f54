"""The scheduler of the suite: a file to a process; a process that crashes is replaced."""

from xdist.scheduler import LoadFileScheduling


class Files(LoadFileScheduling):
    """A file goes to one process, and files that belong together to the same one.

    together: starts of the names of those files.
    """

    def __init__(self, config, log, together):
        super().__init__(config, log)
        self._together = tuple(together)

    def _split_scope(self, nodeid):
        file = super()._split_scope(nodeid)
        return self._together[0] if file.startswith(self._together) else file

    def remove_node(self, node):
        """What a process that has crashed left undone is for others, without the test that it
        crashed in, which is returned: of the base class it would crash the others too."""
        units = self.assigned_work.pop(node)
        unfinished = [
            (scope, n)
            for scope, unit in units.items()
            for n, is_done in unit.items()
            if not is_done
        ]
        if not unfinished:
            return None
        scope, crashed = unfinished[0]
        units[scope][crashed] = True
        self.workqueue.update({n: unit for n, unit in units.items() if not all(unit.values())})
        for other in self.nodes:
            self._reschedule(other)
        return crashed

    def _reschedule(self, node):
        """A process begins a test once it knows the next, or that there is none."""
        if node not in self.registered_collections:
            return  # it replaces one that has crashed, and still collects
        super()._reschedule(node)
        while not node.shutting_down and self._pending_of(self.assigned_work[node]) < 2:
            super()._reschedule(node)
