import logging

from placegraph.runtime import log


def test_level_node_and_text_go_to_standard_error_of_the_moment(capsys) -> None:
    log.configure("pose", "WARNING")
    log.configure("fusion", "INFO")  # the second call replaces the first
    logging.getLogger("placegraph.x").debug("no")
    logging.getLogger("placegraph.x").info("yes")
    said = capsys.readouterr().err
    assert said.endswith(" INFO fusion yes\n") and said.count("\n") == 1
