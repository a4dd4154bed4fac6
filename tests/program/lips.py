"""A head by landmarks whose lower lip adheres to a jaw that moves away from it."""

from conftest import PROJECT, runner


def solve_lips(folder, environment, *options, clinical="set_back: 3", tissue="layers: 3, edge: 8"):
    """Solves lips.yaml in a folder: lips.h5, with the landmarks head.mrk.json beside it."""
    run, head = runner(folder, environment), PROJECT / "meshes/head"
    done = run("repose-landmarks", f"{head}_skin.ply", "-skull", f"{head}_skull.ply", "-mandible",
               f"{head}_mandible.ply", "-output", "head")
    assert (done.returncode, done.stderr) == (0, ""), done
    (folder / "lips.yaml").write_text(
        f"skin: {head}_skin.ply\nbones:\n  - {{name: skull, file: {head}_skull.ply}}\n"
        f"  - {{name: mandible, file: {head}_mandible.ply}}\ntissue: {{{tissue}}}\n"
        "anatomy: {landmarks: head.mrk.json}\n"
        f"moves: [{{bone: mandible, clinical: {{{clinical}}}}}]\n")
    done = run("repose-solve", "lips.yaml", *options)
    assert (done.returncode, done.stderr) == (0, ""), done
    assert "points of the lips adhere to teeth" in done.stdout
    return folder / "lips.h5"
