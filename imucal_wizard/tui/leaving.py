"""A screen on its way out: its parts go before it does, and must not be asked for any more."""

from textual.dom import DOMNode
from textual.widget import Widget
from textual.worker import NoActiveWorker, get_current_worker


def being_left(node: DOMNode) -> bool:
    """Whether a widget or screen is being removed, or the whole app closed."""
    removed = isinstance(node, Widget) and node._pruning
    return removed or not node.is_attached


def worker_is_left() -> bool:
    """Whether the screen that the present worker works for is being left."""
    try:
        return being_left(get_current_worker().node)
    except NoActiveWorker:
        return False
