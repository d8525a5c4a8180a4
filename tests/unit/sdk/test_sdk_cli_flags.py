"""The command of each process: flags for the fields of its request, and errors that name them."""

import json
import math
import re
import shlex
from itertools import pairwise
from pathlib import Path

import pytest
from matplotlib import rc_context

import grazemap
from grazemap import cli, plots
from grazemap.codec import decode_npz, encode_npz
from grazemap.wire import PROCESSES, parse_request
from tests.support.sdk_documents import MANY, MOTIONS, REQUESTS, npz
from tests.support.sdk_fake_service import problem

ROOT = Path(__file__).parents[3]
OSCILLATOR = {
    "units": "SI",
    "masses": [2.0, 20.0, 20.0],
    "stiffnesses": [1.0, 5.0, 5.0],
    "damping": [0.1, 0.2, 0.3],
    "forcing": [-1.0, 0.0, 0.5],
    "restitution": 0.7,
}
CURVE = "grazing-curves --omega 0.2:0.4:5"
GRID = "written START:STOP:POINTS or NUMBER,NUMBER,..."
MACHINE = ["--units", "SI", "--masses", "2,", "--stiffnesses", "800,", "--damping", "0.001", "--forcing", "12,"]
SI = [*MACHINE, "--restitution", "0.8"]


@pytest.fixture
def run(url):
    return lambda *arguments: cli.main([*arguments, "--url", url, "--quiet"])


@pytest.fixture
def refused(run, service, capsys):
    def lines(*arguments):
        assert run(*arguments) == 2
        assert service.requests == []
        first, *errors = capsys.readouterr().err.splitlines()
        assert first.startswith("grazemap: Invalid request: ")
        return [line.strip() for line in errors]

    return lines


def words(fields, *place):
    """Yield the words for the fields of an object in a request, as the guide says how they are written."""
    for name, value in fields.items():
        here = place if name == "oscillator" else (*place, name)
        flag = "--" + "-".join(here).replace("_", "-")
        if isinstance(value, bool):
            yield flag if value else flag.replace("--", "--no-", 1)
        elif isinstance(value, dict) and "start" in value:
            yield from (flag, ":".join(map(str, value.values())))
        elif isinstance(value, dict):
            yield from words(value, *here)
        else:
            yield from (flag, ",".join(map(str, value)) if isinstance(value, list) else str(value))


@pytest.mark.parametrize("process", PROCESSES)
def test_flags_make_the_request_that_json_makes(run, service, tmp_path, process):
    request = {**REQUESTS[process], "oscillator": OSCILLATOR}
    path = tmp_path / "request.json"
    path.write_text(json.dumps(request))
    assert run("run", process, "--json", str(path), "-o", str(tmp_path / "a.npz")) == 0
    assert run(process, *words(request), "-o", str(tmp_path / "b.npz")) == 0
    (job,) = service.jobs.values()
    assert job["process"] == process
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


@pytest.mark.parametrize("process", PROCESSES)
def test_the_example_of_the_help_is_the_first_of_the_process(run, service, capsys, process):
    with pytest.raises(SystemExit):
        cli.main([process, "--help"])
    help_text, _, example = capsys.readouterr().out.rpartition("example: grazemap ")
    assert "in SI: --units SI" in help_text
    run(*shlex.split(example))
    (job,) = service.jobs.values()
    expected = parse_request(process, next(iter(PROCESSES[process].operation.examples.values())))
    assert parse_request(process, job["request"]).canonical() == expected.canonical()


@pytest.mark.parametrize(("sample", "only"), [(MANY, "initial"), (MOTIONS, "motions")])
def test_fields_without_a_flag_come_from_json_and_the_help_names_them(run, service, tmp_path, capsys, sample, only):
    process = sample.split()[0]
    path = tmp_path / "request.json"
    path.write_text(json.dumps(REQUESTS[sample]))
    run(process, "--json", str(path))
    (job,) = service.jobs.values()
    assert len(job["request"][only]) == len(REQUESTS[sample][only])
    with pytest.raises(SystemExit):
        cli.main([process, "--help"])
    rest = f"outputs, {only}" if process == "trajectories" else only
    assert f"Only --json has every form of: {rest}, matrices, forcing." in capsys.readouterr().out


def test_flags_take_precedence_over_json(run, service, tmp_path):
    path = tmp_path / "request.json"
    path.write_text(
        json.dumps({"oscillator": {"restitution": 0.5, "damping": 0.1}, "omega": [1.0, 2.0], "max_order": 3})
    )
    run("grazing-curves", "--json", str(path), "--restitution", "0.6", "--omega", "3:4:2", "--no-sequence")
    (job,) = service.jobs.values()
    request = parse_request("grazing-curves", job["request"]).canonical()
    assert (request["oscillator"]["restitution"], request["oscillator"]["damping"]) == (0.6, 0.1)
    assert (request["axis"]["values"], request["max_order"]) == ({"start": 3.0, "stop": 4.0, "points": 2}, 3)


@pytest.mark.parametrize("short", [False, True])
@pytest.mark.parametrize(
    ("process", "flags", "place", "value"),
    [
        ("bifurcation-diagrams", "--range 1:2:3", "axis/values", {"start": 1.0, "stop": 2.0, "points": 3}),
        ("orbit-branches", "--range 1:2", "axis/values", {"start": 1.0, "stop": 2.0}),
        ("unfolding-maps", "--omega 0.1:0.3:5", "horizontal/values", {"start": 0.1, "stop": 0.3, "points": 5}),
        ("basins", "--vertical-mass 1", "vertical/vary", "velocity[1]"),
        ("basins", "--vertical-vary velocity[1]", "vertical/vary", "velocity[1]"),
        ("bifurcation-diagrams", "--max-period 5", "max_period", 5),
    ],
)
def test_flags_take_precedence_over_the_axes_of_json(run, service, tmp_path, process, flags, place, value, short):
    """The request of a job or of a result has the one form."""
    asked = parse_request(process, REQUESTS[process]).canonical()
    path = tmp_path / "request.json"
    path.write_text(json.dumps(PROCESSES[process].short_form(asked) if short else asked))
    run(process, "--json", str(path), *flags.split())
    (job,) = service.jobs.values()
    *above, name = place.split("/")
    inside = asked
    for part in above:
        inside = inside[part]
    assert inside[name] != value
    inside[name] = value
    assert parse_request(process, job["request"]).canonical() == asked


def test_a_list_of_one_number_ends_with_a_comma(run, service):
    chain = ["--masses", "2", "--stiffnesses", "3", "--forcing", "1"]
    run(*CURVE.split(), *chain, "--damping", "0.1")
    run(*CURVE.split(), *chain, "--damping", "0.1,")
    assert [job["request"]["oscillator"]["damping"] for job in service.jobs.values()] == [0.1, [0.1]]


def test_the_result_and_its_picture_are_written_both(run, tmp_path, capsys):
    result, picture = tmp_path / "curve.npz", tmp_path / "curve.png"
    assert run(*CURVE.split(), "-o", str(result), "--plot", str(picture)) == 0
    assert capsys.readouterr().out.split() == [str(result), str(picture)]
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert grazemap.load(result).process == "grazing-curves"


def test_a_picture_is_no_result(run, service, tmp_path, capsys):
    assert run(*CURVE.split(), "--plot", str(tmp_path / "curve.npz")) == 2
    assert "(--plot) must end in one of .png, .svg, .pdf" in capsys.readouterr().err
    assert service.requests == []


def test_without_a_file_the_result_is_shown_as_by_show(run, tmp_path, capsys):
    path = tmp_path / "curve.npz"
    run(*CURVE.split(), "-o", str(path))
    capsys.readouterr()
    assert run(*CURVE.split()) == 0
    printed = capsys.readouterr().out
    assert cli.main(["show", str(path)]) == 0
    assert printed == capsys.readouterr().out


MAPS = "unfolding-maps --omega 1:2:3 --clearance 1:2:3"
BASINS = "basins --omega 0.29 --clearance 1.6"
IN_SI = f"grazing-curves {shlex.join(SI)}"
NUMBERS = "Input should be a range or a list of numbers"
APART = "Unexpected argument; ranges and lists are written without spaces"
ONE_WAY = "A switch has no value (allowed: --sequence or --no-sequence)"
# by the words: how each line of the error begins, and what follows somewhere in it after each *
ERRORS = {
    "grazing-curves": [f"--omega: Field required (allowed: an object*{GRID}"],
    "grazing-curves --omega 0.2,0.4,100": [
        "--omega 0.2,0.4,100: Three numbers*0.2:0.4:100 for the range, 0.2,0.4,100.0 "
    ],
    "grazing-curves --omega 0.2:0.4": [f"--omega 0.2:0.4: points: Field required*{GRID}"],
    "grazing-curves --omega 0.2:0.4:1.5": [f"--omega 0.2:0.4:1.5: points: *(allowed: an integer >= 2; {GRID}"],
    "grazing-curves --omega 0.4:0.2:5": ["--omega 0.4:0.2:5: stop must be greater*stop > start"],
    "grazing-curves --omega abc": [f"--omega abc: {NUMBERS}*{GRID}"],
    "grazing-curves --omega 0.2 0.4 5": [f"0.4: {APART}", f"5: {APART}", f"--omega 0.2: {NUMBERS}"],
    "codimension-two-points --omega 0.2:0.4:9": ['--omega 0.2:0.4:9: Unknown field "points"*written START:STOP)'],
    f"{CURVE} --masses 1,x,10": ["--masses 1,x,10: number 2: *written NUMBER,NUMBER,...)"],
    f"{CURVE} --restitution 2": [
        "--restitution 2: *(allowed: a finite number >= 0 and <= 1 or an object with the fields "
    ],
    f"{CURVE} --restitution nan": ["--restitution nan: Input should be a finite number"],
    f"{CURVE} --units mm": ['--units mm: *one of "nondimensional", "SI"'],
    f"{CURVE} --units SI": ["--damping: damping has no default in SI units*NUMBER or NUMBER,NUMBER,..."],
    f"{BASINS} --vertical-quantity velocity --vertical-values 1,2": [
        "--horizontal-vary, --horizontal-values, --horizontal-quantity, --horizontal-mass: Field required"
    ],
    f"{MAPS} --adaptive --policy sweep-up": ["--policy sweep-up: a sweep cannot be adaptive"],
    "grazing-curves --omga 1 --restitution 2 --omega 1,2,3 --max-order x": [
        "--omga: Unknown flag; did you mean --omega",
        "--omega 1,2,3: ",
        "--restitution 2: ",
        "--max-order x: ",
    ],
    f"{CURVE} --forcing '{{\"amplitude\": [1]}}' --base 1": [
        "--base: *--base-amplitude",
        "--forcing *NUMBER,NUMBER,...*--forcing-amplitude, --forcing-phase, --forcing-law, --forcing-harmonic)",
    ],
    f"{CURVE} --sequence=yes": [f"--sequence yes: {ONE_WAY}"],
    f"{CURVE} --no-sequence no": [f"--no-sequence no: {ONE_WAY}"],
    f"{CURVE} --quiet=1 --max-order 0": ["--quiet 1: A switch has no value (allowed: --quiet)", "--max-order 0: "],
    "grazing-curves --omega 5Hz:12Hz:9": [f"--omega 5Hz:12Hz:9: Hz is a unit of SI*--units SI; {GRID}"],
    f"{IN_SI} --omega 5mm:6mm:7": ["--omega 5mm:6mm:7: mm is no unit of omega (allowed: Hz, rpm or rad/s in SI; "],
    f"{IN_SI} --omega 5Hz:12:9": ["--omega 5Hz:12:9: Only some of the numbers have a unit (allowed: a unit with each "],
    f"{IN_SI} --omega 1:2:3 --restitution 5mm": ["--restitution 5mm: Input should be a valid number"],
    f"{IN_SI} --omega 5Hz:12Hz:9Hz": ["--omega 5Hz:12Hz:9Hz: points: Input should be a valid integer"],
    "grazing-curves --json wrong.json --max-order 0": [
        '/: Unknown field "max_ordr"; did you mean max_order',
        "/oscillator/restitution 2: ",
        "/omega/points: ",
        "--max-order 0: ",
    ],
    "trajectories --json many.json --initial-phase 1": [
        "--initial-phase 1: initial in --json is not an object*written NUMBER)"
    ],
}


@pytest.mark.parametrize("words", ERRORS)
def test_errors_name_the_flag_the_value_and_the_way_to_write_it(refused, tmp_path, monkeypatch, words):
    monkeypatch.chdir(tmp_path)
    wrong = {"oscillator": {"restitution": 2}, "omega": {"start": 1, "stop": 2}, "max_ordr": 1}
    for name, body in (("wrong.json", wrong), ("many.json", REQUESTS[MANY])):
        Path(name).write_text(json.dumps(body))
    for line, expected in zip(refused(*shlex.split(words)), ERRORS[words], strict=True):
        assert re.match(".*".join(map(re.escape, expected.split("*"))), line), line


def commands_of_the_guides():
    for page in ("README.md", "docs/command-line.md"):
        for line in (ROOT / page).read_text("utf-8").replace("\\\n", " ").splitlines():
            written = shlex.split(line, comments=True) if re.match(r"(    )?grazemap ", line) else []
            if written[1:2] and written[1] in PROCESSES and "--help" not in written:
                yield written[1:]


@pytest.mark.parametrize("arguments", list(commands_of_the_guides()), ids=" ".join)
def test_the_commands_of_the_guides_work(run, tmp_path, monkeypatch, capsys, arguments):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "map.json").write_text(json.dumps(REQUESTS["unfolding-maps"]))
    assert run(*arguments) == 0
    named = [after for flag, after in pairwise(arguments) if flag in ("-o", "--plot")]
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(["map.json", *named])


def test_an_error_of_the_service_names_the_flag(run, service, capsys):
    errors = [{"pointer": "/omega", "detail": "too many points", "allowed": "at most 4"}]
    answer = {"type": "urn:x", "title": "Too much work", "status": 422, "detail": "more than allowed", "errors": errors}
    service.upcoming = [problem(422)]
    service.upcoming[0]._content = json.dumps(answer).encode()
    assert run(*CURVE.split()) == 2
    assert f"--omega 0.2:0.4:5: too many points (allowed: at most 4; {GRID})" in capsys.readouterr().err


def test_the_help_has_one_line_for_each_command(monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "80")
    with pytest.raises(SystemExit):
        cli.main(["--help"])
    lines = capsys.readouterr().out.partition("COMMAND\n")[2].partition("\n\n")[0].splitlines()
    tiles, stacks = ["plan", "tile", "assemble"], ["up", "status", "repair", "backup", "restore"]
    others = ["plot", "show", "schema", "check", "completion"]
    assert [line.split()[0] for line in lines] == [*PROCESSES, "run", *tiles, *stacks, *others]


@pytest.mark.parametrize("words", [["grazing_curves"], ["run", "grazing_curves"]])
def test_names_are_written_with_hyphens_or_underscores(run, service, tmp_path, words):
    output = tmp_path / "my_curve.npz"
    assert run(*words, "--omega", "0.2:0.4:5", "--max_order=3", f"--output={output}") == 0
    (job,) = service.jobs.values()
    assert (job["process"], job["request"]["max_order"]) == ("grazing-curves", 3)
    assert output.exists()


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("grazing-curve --omega 1:2:3", "there is no command grazing-curve; did you mean grazing-curves"),
        ("unfolding_map", "there is no command unfolding-map; did you mean unfolding-maps"),
        ("run unfolding-map", "there is no process unfolding-map; did you mean unfolding-maps"),
        ("schema grazing_curve", "there is no process grazing-curve; did you mean grazing-curves"),
        ("completion bsh", "there is no shell bsh; did you mean bash"),
        ("wobble", "there is no command wobble (allowed: structures, grazing-curves, "),
        ("status --ulr http://x", "--ulr: Unknown flag; did you mean --url"),
        ("show a.npz --quiet", "--quiet: Unknown flag"),
        ("plot a.npz b.npz", "b.npz: Unexpected argument"),
    ],
)
def test_a_command_process_or_flag_that_is_misspelt_is_named_with_the_nearest(capsys, words, told):
    with pytest.raises(SystemExit) as caught:
        cli.main(words.split())
    assert caught.value.code == 2
    assert told in capsys.readouterr().err


PATH = "trajectories --periods 2 --omega"
LINE = "bifurcation-diagrams --vary"
RECTANGLE = "--vertical-quantity velocity --vertical-mass 1 --vertical-values -0.1:0.1:3"


# by the words: fields of the request in SI
def axis(vary, **values):
    return {"vary": vary, "values": values}


IN_UNITS = {
    "unfolding-maps --omega 2.5Hz:4Hz:3 --clearance 1mm:5mm:2": {
        "horizontal": axis("omega", start=5.0 * math.pi, stop=8.0 * math.pi, points=3),
        "vertical": axis("clearance", start=0.001, stop=0.005, points=2),
    },
    f"{PATH} 3Hz --clearance 0.002m --initial-displacement -1mm,": {
        "omega": 6.0 * math.pi,
        "clearance": 0.002,
        "initial": {"displacement": [-0.001], "velocity": [0.0], "phase": 0.0},
    },
    f"{LINE} clearance --range 1e0mm:5.mm:4 --omega 20rad/s": {
        "axis": axis("clearance", start=0.001, stop=0.005, points=4),
        "omega": 20.0,
    },
    f"{LINE} masses[1] --range 1kg:2000g:3 --omega 20 --clearance 5mm": {
        "axis": axis("masses[1]", start=1.0, stop=2.0, points=3)
    },
    f"{LINE} omega --range 1Hz,2Hz, --clearance 5mm": {
        "axis": {"vary": "omega", "values": [2.0 * math.pi, 4.0 * math.pi]},
        "clearance": 0.005,
    },
    "orbit-branches --omega 20 --clearance 5mm --range 4mm:6mm --motion-period 1 --motion-stops 1,": {
        "axis": axis("clearance", start=0.004, stop=0.006)
    },
    "basins --omega 20 --clearance 5mm --horizontal-quantity displacement --horizontal-mass 1 "
    f"--horizontal-values -1mm:1mm:3 {RECTANGLE}": {
        "horizontal": axis("displacement[1]", start=-0.001, stop=0.001, points=3)
    },
}


@pytest.mark.parametrize("words", IN_UNITS)
@pytest.mark.filterwarnings("ignore::grazemap.errors.RequestWarning")
def test_frequencies_and_lengths_may_have_units_in_si(run, service, words):
    assert run(*shlex.split(words), *SI) in (0, 3)
    (job,) = service.jobs.values()
    request = parse_request(job["process"], job["request"]).canonical()
    assert {name: request[name] for name in IN_UNITS[words]} == IN_UNITS[words]


def test_the_fields_of_an_oscillator_may_have_units_in_si(run, service):
    words = "--units SI --masses 500g,2kg --stiffnesses 2N/mm,8kN/m --forcing-law unbalance --base-stops-move"
    lists = ["--damping", "1.5 N s/m,0.006N s/mm", "--forcing-amplitude", "3 kg mm,0", "--base-amplitude", "0.2 mm"]
    assert run(*CURVE.split(), *words.split(), *lists) == 0
    (job,) = service.jobs.values()
    oscillator = job["request"]["oscillator"]
    assert (oscillator["masses"], oscillator["stiffnesses"]) == ([0.5, 2.0], [2000.0, 8000.0])
    (force,) = oscillator["forcing"]
    assert (oscillator["damping"], force["amplitude"]) == ([1.5, 6.0], [0.003, 0.0])
    assert oscillator["base"]["amplitude"] == 0.0002


def test_units_are_of_the_oscillator_in_json_too(run, service, tmp_path, capsys):
    path = tmp_path / "request.json"
    oscillator = {**OSCILLATOR, "damping": 0.01}
    path.write_text(json.dumps({"oscillator": oscillator, "omega": [1.0, 2.0, 3.0]}))
    assert run("grazing-curves", "--json", str(path), "--omega", "1Hz:2Hz:3") == 0
    (job,) = service.jobs.values()
    assert job["request"]["axis"]["values"]["start"] == 2.0 * math.pi
    with pytest.raises(SystemExit):
        cli.main(["unfolding-maps", "--help"])
    helped = " ".join(capsys.readouterr().out.split())
    assert "In SI also as 5Hz." in helped
    assert "In SI also as 5mm." in helped


@pytest.mark.parametrize(
    ("omega", "shown"),
    [
        ("1Hz:2Hz:3", ("Hz", "mm")),
        ("60rpm:120rpm:3", ("rpm", "mm")),
        ("6.3rad/s:12.6rad/s:3", ()),
        ("6.3:12.6:3", ()),
    ],
)
def test_a_picture_has_the_units_that_were_written(run, tmp_path, monkeypatch, omega, shown):
    drawn = []
    monkeypatch.setattr(plots, "save_picture", lambda result, *_, **options: drawn.append((result, options)))
    command = [*SI, "--omega", omega, "--plot", str(tmp_path / "curve.svg"), "--style", "column"]
    assert run("grazing-curves", *command) == 0
    ((result, options),) = drawn
    assert result.shown_units == shown
    assert options == {"style": "column"}


def test_a_saved_result_in_si_is_drawn_in_hertz_and_millimetres(tmp_path, capsys):
    result, picture = tmp_path / "curve.npz", tmp_path / "curve.svg"
    document, meta = decode_npz(npz("grazing-curves"))
    result.write_bytes(encode_npz(document, meta))
    assert cli.main(["plot", str(result), "-o", str(picture), "--engineering-units"]) == 2
    assert "for results in SI, and this one is nondimensional" in capsys.readouterr().err
    oscillator = {**meta["request"]["oscillator"], "units": "SI"}
    result.write_bytes(encode_npz(document, meta | {"request": {**meta["request"], "oscillator": oscillator}}))
    for switch, expected in (([], {"rad/s", "m"}), (["--engineering-units"], {"Hz", "mm"})):
        with rc_context({"svg.fonttype": "none"}):
            assert cli.main(["plot", str(result), "-o", str(picture), *switch]) == 0
            assert cli.main(["plot", *switch, str(result), "-o", str(picture)]) == 0
        assert set(re.findall(r"\((Hz|rad/s|mm|m)\)", picture.read_text())) == expected


@pytest.mark.parametrize(
    ("words", "note"),
    [
        ("--omega 10Hz,13Hz --clearance 1mm:2mm:2", "for a range write 10Hz:13Hz:POINTS"),
        ("--omega 2:3:48 --clearance 1mm:2mm:2", ": write --omega 2Hz:3Hz:48 if Hz was meant"),
        ("--omega 2Hz:3Hz:4 --clearance 10:60:4", "write --clearance 10mm:60mm:4 if mm was meant"),
    ],
)
def test_a_note_says_what_to_write_on_the_command_line(run, capsys, words, note):
    machine = ["--units", "SI", "--masses", "1", "--stiffnesses", f"{16 * math.pi**2}", "--damping", "0.005"]
    run("unfolding-maps", *machine, "--forcing", "1", "--restitution", "0.8", *words.split())
    assert note in capsys.readouterr().err
