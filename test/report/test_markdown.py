"""Names out of a bag stay words in Markdown."""
from ssi_ros.report.markdown import markdown
from ssi_ros.report.parts import Section, Table


def test_names_do_not_forge_headings_rows_links_or_tags():
    """Line ends, bars, tags, links, code and lists in every part of a page."""
    evil = '/a\n# Forged\n- x [y](http://z) <script> `b` | c'
    text = markdown(evil, evil, [Section(evil, lines=(evil, '# Forged', '- x', '1. x'), tables=(
        Table((evil, 'b'), ((evil, '1'),), evil),),
        commands=('ssi_ros info "a\n```\n# Forged"',))])
    lines = text.splitlines()
    assert [line for line in lines if line.startswith('#')] == [
        line for line in lines if line.startswith(('# /a', '## /a'))]
    assert not any(line.lstrip().startswith(('- ', '1. ', '<')) for line in lines)
    assert '\\<script>' in text and '\\[y](http' in text and '\\`b\\`' in text
    assert text.count('```') == 2 and sum(line.startswith('| ') for line in lines) == 2
