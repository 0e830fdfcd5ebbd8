"""`vlnhijack doctor`"""

import typer


def doctor() -> None:
    """Say what this machine lacks and how to get it; status 1 where something required lacks."""
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    from vlnhijack.doctor import examine

    findings = examine()
    table = Table()
    for heading in ("", "what", "found", "how to get it"):
        table.add_column(heading, overflow="fold")
    for finding in findings:
        mark = "[green]ok" if finding.ok else "[red]missing" if finding.required else "optional"
        fix = "" if finding.ok else finding.fix
        table.add_row(mark, finding.name, escape(finding.found), escape(fix))
    Console().print(table)
    if any(finding.required and not finding.ok for finding in findings):
        raise typer.Exit(1)
