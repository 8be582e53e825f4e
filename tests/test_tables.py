"""Load cases and layers from CSV files; every error names its line."""

import dataclasses

import pytest

from skfem_dual import HalfSpace, Layer, LayeredHalfSpace, Load
from skfem_dual.io import read_cases, read_substrate


def write(tmp_path, text, name="cases.csv"):
    path = tmp_path / name
    path.write_bytes(text.encode())
    return path


def test_where_forces_act_and_what_moments_do(tmp_path):
    """A force off the origin, in three ways that are the same load."""
    origin = (10.0, 20.0)
    by_place = write(tmp_path, "name,force,x,y\na,2,10.5,19.75\n")
    by_arm = write(tmp_path, "\ufeff# site\nName; Force; EX; EY\n\na; 2; 0.5; -0.25\n", "b.csv")
    by_moment = write(tmp_path, "name\tforce\tmx\tmy\na\t2\t-0.5\t1.0\n", "c.csv")
    for path in (by_place, by_arm, by_moment):
        (row,) = read_cases(path)
        assert Load(**row.load(origin)).point == pytest.approx((0.5, -0.25))
    (row,) = read_cases(write(tmp_path, 'name,force\n"dead, live",1e3\n'))
    assert (row.name, row.load(origin)) == ("dead, live", {"force": 1e3, "at": (0.0, 0.0)})


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "a line of headings and 1 to"),
        ("name,force\n", "got 1 lines"),
        ("force\n1\n", "line 1: expected a heading name, got force"),
        ("name,weight\na,1\n", "line 1: expected headings among .*, got 'weight'"),
        ("name,force,force\na,1,1\n", "line 1: expected each heading once"),
        ("name,force,x\na,1,1\n", "line 1: expected both x and y"),
        ("name,force,x,y,ex,ey\na,1,1,1,1,1\n", "line 1: expected either x, y or ex, ey"),
        ("name,force,mx,my\na,1,,0\n", "line 2: expected a number for mx, got none. Remedy: 0"),
        ("name,force\n\n# no\na,1\nb,heavy\n", "line 5: expected a number for force, got 'heavy'"),
        ("name;force\na;1200 300\n", "line 2: expected a number for force, got '1200 300'"),
        ("name;force\na;12.5 300\n", "line 2: expected a number for force, got '12.5 300'"),
        ("name;force\na;0 500\n", "line 2: expected a number for force, got '0 500'"),
        ('name,force\na,"1,5"\n', "line 2: .*Remedy: a decimal point"),
        ("name;force\na;1,500\n", "line 2: .*may be decimal or part thousands.*1500 or 1,5000"),
        ("name;force\na;-1.000\nb;2.000\n", "line 2: .*point may be decimal.*-1000 or -1.0000"),
        ("name\tforce\na\t5\nb\t2.000\n", "line 3: .*point may be decimal or part thousands"),
        ("name;force\na;1.000,5\nb;0.25\n", "line 3: expected decimal commas or decimal points"),
        ("name;force\na;1,5\nb;25.000\n", "line 3: expected decimal commas or decimal points"),
        ("name;force [kN]\na;1,5\n", "line 1: expected units .* force in kN. Remedy: units="),
        ("name,force\na,inf\n", "line 2: expected a finite number for force"),
        ("name,force\na,1,2\n", "line 2: expected 2 columns, got 3"),
        ("name,force\n,1\n", "line 2: expected a name"),
        ("name,force,\na,1,2\n", "line 2: expected 2 columns, got 3"),
        ('name,force\na,1\n"b,1\nc,1\n', "line 3: expected a quoted cell that ends"),
        ('force;name\n1;"P\n2;"Q\n3;R\n', "line 2: expected a quoted cell that ends"),
        ('name,force\n"P,1\nQ,2\n"R",3\nS,4\n', "line 2: expected a quoted cell that ends"),
        ('name,force\n"a\n",1\nb,x\n', "line 4: expected a number for force, got 'x'"),
        ("name,force\na,1\na,2\n", "line 3: expected another name than 'a', see .*line 2"),
    ],
)
def test_wrong_tables_name_the_line(tmp_path, text, message):
    with pytest.raises(ValueError, match=message):
        read_cases(write(tmp_path, text))


@pytest.mark.parametrize(
    ("first", "second", "forces"),
    [
        ("1.000", "0.500", (1.0, 0.5)),
        ("1.000", "-12.3456", (1.0, -12.3456)),
        ("1.000", "1.5E3", (1.0, 1500.0)),
        ("1.000,5", "2.000", (1000.5, 2000.0)),
        ("1.000.000,5", "-0,25", (1000000.5, -0.25)),
        ("1.234.567", "1.000", (1234567.0, 1000.0)),
        ("1.234.567", "0,5", (1234567.0, 0.5)),
        ("1,234,567", "2,000", (1234567.0, 2000.0)),
        ("1,000.5", "2,000", (1000.5, 2000.0)),
    ],
)
def test_one_number_tells_what_the_marks_of_others_are(tmp_path, first, second, forces):
    found = read_cases(write(tmp_path, f"name;force\na;{first}\nb;{second}\n"))
    assert tuple(row.force for row in found) == forces
    (row,) = read_cases(write(tmp_path, "name,force\na,1.000\n"))
    assert row.force == 1.0


@pytest.mark.parametrize(
    "text",
    [
        "sep=;\r\nName;Force\r\ndead load;1,5\r\n",
        "SEP=|\nname|force\ndead load|1,5\n",
        "sep=\t\nname\tforce\ndead load\t1,5\n",
        "name;force;;\ndead load;1,5;\n\n;;;\n",
        'name;"force\n"\n# "\n"dead\nload";1,5\n',
        '"name" ,"force"\n"dead load" ,1.5',
    ],
)
def test_tables_as_excel_has_them(tmp_path, text):
    """What parts the columns in a first line, empty columns, line breaks in quoted cells."""
    (row,) = read_cases(write(tmp_path, text))
    assert (row.name, row.force) == ("dead load", 1.5)


@pytest.mark.parametrize(
    "heads", ["name;force;mx;my", '"name";force;"mx";my', 'name;"force\n";mx;my']
)
@pytest.mark.parametrize("name", ['5" pipe', '"5"" pipe"'])
def test_what_parts_columns_beside_quotes(tmp_path, heads, name):
    (row,) = read_cases(write(tmp_path, f"{heads}\n{name};1,5;0;0\n"))
    assert (row.name, row.force) == ('5" pipe', 1.5)


def test_quotes_in_cells(tmp_path):
    """Comments and empty lines are such between cells only; a quote inside is one of inches."""
    text = '"force\n[kN]";name\n1;"P\n#2"\n\n# no\n2;"Q" \n3;5" pipe\n'
    rows = read_cases(write(tmp_path, text), units="kN,m")
    assert [(row.force, row.name) for row in rows] == [(1.0, "P #2"), (2.0, "Q"), (3.0, '5" pipe')]
    assert [row.where.rsplit(" ", 1)[1] for row in rows] == ["3", "7", "8"]


def test_unicode_text_of_excel(tmp_path):
    path = tmp_path / "loads.csv"
    path.write_text("name\tforce\tex\tey\nWind, Süd\t1,5\t0,25\t0\n", encoding="utf-16")
    (row,) = read_cases(path)
    assert (row.name, row.force) == ("Wind, Süd", 1.5)


def test_files_that_are_none(tmp_path):
    with pytest.raises(FileNotFoundError, match="no such file"):
        read_cases(tmp_path / "none.csv")
    path = tmp_path / "x.csv"
    path.write_bytes(b"name,force\n\xff\xfe,1\n")
    with pytest.raises(ValueError, match=r"text in UTF-8 in .*byte 0xff in line 2\."):
        read_cases(path)


def test_layers(tmp_path):
    text = "thickness, E, nu\n2.0, 20e6, 0.3\n3.0, 40e6, 0.25\n, 60e6, 0.2\n"
    layers = [Layer(2.0, 20e6, 0.3), Layer(3.0, 40e6, 0.25)]
    expected = LayeredHalfSpace(layers, HalfSpace(60e6, 0.2))
    assert repr(read_substrate(write(tmp_path, text, "g.csv"))) == repr(expected)
    rigid = text.replace(", 60e6, 0.2", "rigid,,")
    found = read_substrate(write(tmp_path, rigid, "g.csv"))
    assert repr(found) == repr(LayeredHalfSpace(layers, "bonded"))
    alone = write(tmp_path, "thickness;E;nu\ninf;60e6;0.2\n", "g.csv")
    assert read_substrate(alone) == HalfSpace(60e6, 0.2)


@pytest.mark.parametrize("mark", ["'", "\N{RIGHT SINGLE QUOTATION MARK}"])
def test_apostrophes_of_any_kind(tmp_path, mark):
    text = f"épaisseur,module d{mark}Young,nu\n2,1,0.2\n,3,0.2\n"
    found = read_substrate(write(tmp_path, text, "g.csv"))
    assert repr(found) == repr(LayeredHalfSpace([Layer(2.0, 1.0, 0.2)], HalfSpace(3.0, 0.2)))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "xi,E,nu\n,1,0\n",
            "line 1: expected the headings thickness, E, nu.*the column 'xi'.*or leave it out",
        ),
        ("h,E,G,nu\n2,1,1,0\n", "line 1: expected .* one of E and G"),
        ("h,z,E,nu\n2,2,1,0\n", "line 1: expected .* one of thickness, depth"),
        ("h,dicke,E,nu\n2,2,1,0\n", "line 1: expected one column of thickness, got dicke"),
        ("h,phi,Es,nu\n2,30,1,0\n", "line 1: expected Young's modulus E, got es.*Remedy: E = Es"),
        ("h [m],E,nu\n2,1,0\n,1,0\n", "line 1: expected units .* Remedy: units="),
        ("top,E,nu\n1,1,0\n2,1,0\n", "line 2: expected a layer from 0 on, .* got one from 1"),
        ("from,to,E,nu\n0,2,1,0\n3,,1,0\n", "line 3: expected a layer from 2 on"),
        ("depth,E,nu\n2,1,0\n1,1,0\n,1,0\n", "line 3: expected a positive thickness, got -1"),
        ("depth,E,nu\n1,1,0\n2,1,0\n", "line 3: expected what lies below"),
        ("thickness,E,nu\n2,1,0\n", "line 2: expected what lies below .*rigid"),
        ("thickness,E,nu\n2,1,0\n,rock,\n", "line 3: expected nu of what lies below .*rigid"),
        ("thickness,E,nu\n,1,0\n,1,0\n", "line 2: expected a number for thickness, got ''"),
        ("thickness,E,nu\n2,soft,0\n,1,0\n", "line 2: expected a number for E, got 'soft'"),
        ("thickness,E,nu\n2,1,0.7\n,1,0\n", "line 2: .*0 to 0.5"),
        ("thickness,E,nu\nrigid,,\n", "line 2: expected layers on the bonded base, got none"),
        ("thickness,E,nu\n2,1,0\nrigid,8,.2\n", "line 3: expected a rigid base, .* got 8 as well"),
        ("thickness,E,nu\n2,2_0e3,0\n,1,0\n", "line 2: expected a number for E, got '2_0e3'"),
    ],
)
def test_wrong_layers_name_the_line(tmp_path, text, message):
    with pytest.raises(ValueError, match=message):
        read_substrate(write(tmp_path, text, "g.csv"))


def test_columns_of_weights_and_strengths_do_not_count(tmp_path):
    plain = read_substrate(write(tmp_path, "h,E,nu\n1.5,15,.35\n,80,.3\n", "a.csv"))
    text = "No.,h,E,nu,γ [kN/m3],phi [°],Bemerkung\n1,1.5,15,.35,19,30,weich\n2,,80,.3,20,35,\n"
    assert read_substrate(write(tmp_path, text, "b.csv")) == plain


CLAY, SAND = Layer(1.5, 8e3, 0.35), Layer(4.5, 40e3, 0.3)


@pytest.mark.parametrize(
    ("text", "base"),
    [
        ("Boden;Mächtigkeit [m];E [MPa];ν [-]\nTon;1,5;8;0,35\nSand;4,5;40;0,3\nKies;∞;80;0,3\n",
         HalfSpace(80e3, 0.3)),
        ("name,depth,E,nu\nclay,+0e0,8e3,.35\nsand,1.5,4e4,.3\ngravel,6,8e4,.3\n",
         HalfSpace(80e3, 0.3)),
        ("name,depth (m),E / MN/m2,nu\nclay,0,8,.35\nsand,1.5,40,.3\ngravel,6.0,80,.3\n",
         HalfSpace(80e3, 0.3)),
        ("soil,UK [cm],E in kPa,nu\nclay,150,8000,.35\nsand,600,40 000,.3\nrock,,rigid,\n",
         "bonded"),
        ("couche\tde\tà\tE (kN/m²)\tnu\nargile\t0\t1,5\t8\u202f000\t0,35\n"
         "sable\t1,5\t6\t40\u202f000\t0,3\ngrave\t6\t-\t80\u202f000\t0,3\n",
         HalfSpace(80e3, 0.3)),
        ("soil,h,E,nu\nclay,1.5,8e3,.35\nsand,4.5,4e4,.3\nRigid,,,\n", "bonded"),
        ("top;G;nu\n0;2962,962962962963;0,35\n1,5;15384,615384615385;0,3\n6;smooth;\n", "smooth"),
    ],
    ids=["thickness", "a top of +0", "tops", "bottoms", "from and to", "name of the base",
         "shear modulus"],
)  # fmt: skip
def test_tables_of_geotechnical_reports(tmp_path, text, base):
    """The same two layers, as reports in three languages have them."""
    found = read_substrate(write(tmp_path, text, "g.csv"), "kN,m")
    for layer, expected in zip(found.layers, (CLAY, SAND), strict=True):
        assert dataclasses.astuple(layer) == pytest.approx(dataclasses.astuple(expected))
    assert found.base == base


def test_units_of_headings_are_changed(tmp_path):
    text = "Lastfall;V [MN];EX (mm);EY (mm);mx [kN m];my [Nmm]\n1.1;1,2;250;-100;3;4,5e6\n"
    (row,) = read_cases(write(tmp_path, text), "kN,m")
    assert row.name == "1.1"
    assert row.force == pytest.approx(1200.0)
    assert row.eccentricity == pytest.approx((0.25, -0.1))
    assert row.moments == pytest.approx((3.0, 4.5))
    with pytest.raises(ValueError, match=r"heading for.*: expected a unit of force .*, got 'kg'"):
        read_cases(write(tmp_path, "name,force [kg]\na,1\n"), "kN,m")


@pytest.mark.parametrize("heading", ["F", "P [kN]", "Kräfte", "Last"])
def test_words_for_a_force(tmp_path, heading):
    (row,) = read_cases(write(tmp_path, f"case;{heading}\nA;1200\n"), "kN,m")
    assert row.force == 1200.0


@pytest.mark.parametrize(
    "text",
    [
        "top [cm];bottom [m];E [MPa];nu\n0;0,7;20;0,3\n70;2,1;40;0,3\n210;;80;0,25\n",
        "from [m];to [cm];E [MPa];nu\n0;70;20;.3\n.7;210;40;.3\n2.1;;80;.25\n",
    ],
)
def test_depths_in_two_units_meet(tmp_path, text):
    ground = read_substrate(write(tmp_path, text), "kN,m")
    assert [layer.thickness for layer in ground.layers] == pytest.approx([0.7, 1.4], rel=1e-12)
    gap = text.replace("70;2,1", "70,0001;2,1").replace(".7;210", ".700001;210")
    with pytest.raises(ValueError, match=r"a layer from 0.7 on.* got one from 0.70"):
        read_substrate(write(tmp_path, gap), "kN,m")
