"""Particles of the continuum from files of other programs, and what such files may not say."""

import bz2
import gzip
import lzma

import netCDF4
import numpy as np
import pytest
import xarray as xr
from pydantic import TypeAdapter

from dusttaichi.continuum import samples
from dusttaichi.continuum.samples import AnyParticles, Matter
from dusttaichi.errors import DustError
from dusttaichi.scene import Scene

SPEC = TypeAdapter(AnyParticles)
SPACING, MASS = 1e-4, 3e-6  # m, kg/m: 0.15 of a solid of 2000 kg/m^3 on a square of the spacing
KEYS = {"spacing": SPACING, "solid": 2000.0, "filling_factor": 0.15, "most": 0.58}
MATTER = {d: Matter(dimension=d, support=2.6e-4, **KEYS) for d in (2, 3)}
GRID = [(i, k) for k in range(4) for i in range(5)]  # 20 particles of a lattice, in spacings


def lines(head, row, grid=GRID):
    """A heading, and for each particle the row with its {n}, {i} and {k}, {x} and {z} in mm."""
    rows = [row.format(n=n, i=i, k=k, x=0.1 * i, z=0.1 * k) for n, (i, k) in enumerate(grid)]
    return "".join(f"{line}\n" for line in ([head] if head else []) + rows)


def read(tmp_path, content, dimension=2, name="p.csv", **keys):
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    block = {"kind": "explicit", "file": str(path), **keys}
    return samples.make_particles(SPEC.validate_python(block), MATTER[dimension])


PLAIN = lines("x,z,mass", "{i}e-4,{k}e-4,3e-6")
COMMAS = lines("x;z;mass", "{i},0e-4;{k},0e-4;3,0e-6")
READ = {
    "plain": PLAIN,
    "quotes": lines('"x","z","mass"', "{i}e-4,{k}e-4,3e-6"),
    "quotes around numbers": lines('"x","z","mass"', '"{i}e-4","{k}e-4","3e-6"'),
    "single quotes": lines("'x','z','mass'", "{i}e-4,{k}e-4,3e-6"),
    "units in brackets": lines("x [mm],z [mm],mass [kg/m]", "{x},{z},3e-6"),
    "units in parentheses": lines("x (mm), z (mm), m (g/m)", "{x},{z},3e-3"),
    "units without a blank": lines("X[mm],Z[mm],MASS[kg/m]", "{x},{z},3e-6"),
    "units behind a slash": lines("x / mm,z / mm,mass / (mg/m)", "{x},{z},3"),
    "units behind in": lines("x in mm;z in mm;mass in mg/m", "{x};{z};3"),
    "units behind a line": lines("x_mm,z_mm,mass_kg_per_m", "{x},{z},3e-6"),
    "units in capitals": lines("X_MM,Z_MM,MASS_KG", "{x},{z},3e-6"),
    "a row of units": lines("x,z,mass\nmm,mm,kg/m", "{x},{z},3e-6"),
    "masses of a metre of depth": lines("x,z,mass [mg]", "{i}e-4,{k}e-4,3"),
    "capitals": lines("X,Z,Mass", "{i}e-4,{k}e-4,3e-6"),
    "blanks in the header": lines(" x , z , mass ", "{i}e-4, {k}e-4, 3e-6"),
    "blanks": lines("x z mass", "{i}e-4 {k}e-4 3e-6"),
    "aligned": lines("    x       z     mass", "  {i}e-4   {k}e-4    3e-6"),
    "tabs": lines("x\tz\tmass", "{i}e-4\t{k}e-4\t3e-6"),
    "semicolons": lines("x;z;mass", "{i}e-4;{k}e-4;3e-6"),
    "decimal commas": COMMAS,
    "spreadsheet": "\ufeffsep=;\r\n" + COMMAS.replace("\n", "\r\n"),
    "index": lines(",x,z,mass", "{i}{k},{i}e-4,{k}e-4,3e-6"),
    "named index": lines("index,x,z,mass", "{i}{k},{i}e-4,{k}e-4,3e-6"),
    "index of R": lines('"x" "z" "mass"', '"{n}" {i}e-4 {k}e-4 3e-6'),
    "byte order mark": "\ufeff" + PLAIN,
    "windows": PLAIN.replace("\n", "\r\n"),
    "latin": lines("x [µm],z [µm],mass", "{i}e2,{k}e2,3e-6").encode("latin-1"),
    "separator at the end": lines("x;z;mass;", "{i}e-4;{k}e-4;3e-6;"),
    "comments": "# SPH, t = 0\n" + lines("x,z,mass", "{i}e-4,{k}e-4,3e-6") + "# the end\n",
    "commented header": lines("# x z mass", "{i}e-4 {k}e-4 3e-6"),
    "commented header with units": lines("# x[mm] z[mm] mass[kg/m]", "{x} {z} 3e-6"),
    "empty lines": "\n" + lines("x,z,mass", "{i}e-4,{k}e-4,3e-6").replace("\n", "\n\n"),
    "exponents of Fortran": lines("x z mass", "{i}.D-4 {k}.0D-04 3.0D-06"),
    "tabs behind commas": lines("x,\tz,\tmass", "{i}e-4,\t{k}e-4,\t3e-6"),
    "extended XYZ": lines("20\nProperties=pos:R:3:mass:R:1", "{i}e-4 0 {k}e-4 3e-6"),
    "Greek": lines("x (µm),z (μm),mass (kg·m⁻¹),ρ (kg m⁻³)", "{i}e2,{k}e2,3e-6,300"),
    "other order": lines("rho,mass,z,x", "300,3e-6,{k}e-4,{i}e-4"),
    "names of ParaView": lines('"mass","Points:0","Points:1","Points:2"', "3e-6,{i}e-4,0,{k}e-4"),
    "names of a table": lines("Position.X,Position.Z,Mass", "{i}e-4,{k}e-4,3e-6"),
    "filling factors": lines("x,z,mass,phi", "{i}e-4,{k}e-4,3e-6,0.15"),
    "per cent": lines("x,z,mass,phi [%]", "{i}e-4,{k}e-4,3e-6,15"),
    "g/cm^3": lines("x,z,mass,density (g/cm^3)", "{i}e-4,{k}e-4,3e-6,0.3"),
    "kg m^-3": lines("x,z,mass,density [kg m^-3]", "{i}e-4,{k}e-4,3e-6,300"),
    "gz": gzip.compress(PLAIN.encode()),
    "bz2": bz2.compress(COMMAS.encode()),
    "xz": lzma.compress(PLAIN.encode()),
    "count first": "20\n" + PLAIN,
}


@pytest.mark.parametrize("name", READ)
def test_lists_of_particles(tmp_path, name):
    """20 particles of filling factor 0.15, whatever the file is called."""
    sample = read(tmp_path, READ[name], name="p.dat")
    by_row = sample.position[np.lexsort((sample.position[:, 0], sample.position[:, 2]))]
    expected = SPACING * np.array([(i, 0, k) for i, k in GRID])
    np.testing.assert_allclose(by_row, expected, rtol=1e-12, atol=1e-18)
    np.testing.assert_allclose(sample.mass, MASS, rtol=1e-12)
    np.testing.assert_allclose(sample.density, 300.0, rtol=1e-12)
    assert not sample.velocity.any() and "remarks" not in sample.info


def test_the_unit_of_the_scene_is_that_of_lengths(tmp_path):
    text = lines("x,z,mass,vx,vz", "{x},{z},3e-6,1,-2")
    sample = read(tmp_path, text, units="mm")
    np.testing.assert_allclose(np.ptp(sample.position, axis=0), [4e-4, 0, 3e-4], rtol=1e-12)
    assert sample.velocity.tolist() == [[1, 0, -2]] * 20
    sample = read(tmp_path, text.replace("x,z,mass", "x [mm],z [mm],mass"), units="um")
    np.testing.assert_allclose(np.ptp(sample.position, axis=0), [4e-4, 0, 3e-4], rtol=1e-12)
    assert "it names its units, so that sample.units is not used" in sample.info["remarks"][0]


def test_columns_without_names(tmp_path):
    bare = lines("", "3e-6 {k}e-4 7 {i}e-4")
    with pytest.raises(DustError, match=r"have no names, .* columns: \[x, z, mass\]"):
        read(tmp_path, bare)
    sample = read(tmp_path, bare, columns=["mass", "z", "_", "x"])
    np.testing.assert_allclose(np.ptp(sample.position, axis=0), [4e-4, 0, 3e-4], rtol=1e-12)
    named = read(
        tmp_path, lines("x,z,mass", "{x},{z},3"), columns=["x [mm]", "z [mm]", "mass [mg]"]
    )
    np.testing.assert_allclose(named.mass, MASS, rtol=1e-12)
    scene = {"name": "p", "method": "continuum", "material": "dust_g09", "stop": {"steps": 1}}
    scene |= {"sample": {"kind": "explicit", "file": str(tmp_path / "p.csv"), "columns": ["rad1"]}}
    with pytest.raises(DustError, match="sample.columns.*'rad1' is no name of a column; allowed"):
        Scene.from_dict(scene | {"numerics": {"spacing": "0.1 mm"}})


def test_what_is_not_read_is_listed(tmp_path):
    """Also of bodies of several, and beside columns that are read in another way."""
    text = lines("x,y,mass,vx,h,u,radius", "{i}e-4,{k}e-4,3e-6,1,2e-4,0,5e-5")
    sample = read(tmp_path, text)
    assert sample.position[:, 2].max() == pytest.approx(3e-4) and not sample.position[:, 1].any()
    plane, zeros, unread = sample.info["remarks"]
    assert plane.endswith("its x and y are read as x and z: with dimension: 2 the plane is x-z")
    assert zeros.endswith("p.csv: it has no vz, read as 0")
    assert unread.endswith("p.csv: h, u, radius")
    flat = read(tmp_path, lines("x,y,z,mass", "{i}e-4,{k}e-4,0,3e-6"))
    assert flat.position[:, 2].max() == pytest.approx(3e-4) and not flat.position[:, 1].any()
    read(tmp_path, text)
    body = {"kind": "explicit", "file": str(tmp_path / "p.csv")}
    two = {"kind": "several", "bodies": [body, body | {"position": ["1 mm", "0 mm"]}]}
    together = samples.make_particles(SPEC.validate_python(two), MATTER[2])
    assert together.info["remarks"] == [plane, zeros, unread] * 2
    assert not any("remarks" in info for info in together.info["bodies"])


CUBE = [(i, k) for k in range(3) for i in range(9)]
IN_SPACE = "".join(f"{n % 3}e-4,{n // 3 % 3}e-4,{n // 9}e-4,3e-10\n" for n in range(27))


def test_particles_in_space(tmp_path):
    sample = read(tmp_path, "x,y,z,mass\n" + IN_SPACE, dimension=3)
    np.testing.assert_allclose(np.ptp(sample.position, axis=0), 2e-4, rtol=1e-12)
    assert "remarks" not in sample.info
    with pytest.raises(DustError, match="it lacks y; allowed: x, y, z"):
        read(tmp_path, PLAIN, dimension=3)
    with pytest.raises(DustError, match="mass = '1 kg/m': a mass is needed"):
        read(tmp_path, "x,y,z,mass [kg/m]\n" + IN_SPACE, dimension=3)


def test_stresses(tmp_path):
    """Components of a deviator: one of the diagonal follows, others that are missing are 0."""
    text = lines("x,z,mass,density,reference,xx,zz,xz", "{i}e-4,{k}e-4,3e-6,301,300,5,1,2")
    sample = read(tmp_path, text)
    assert sample.deviator.tolist() == [[5, -6, 1, 0, 2, 0]] * 20
    assert sample.reference.tolist() == [300.0] * 20
    kilo = read(tmp_path, text.replace("xx,zz,xz", "xx [kPa],zz [kPa],xz [kPa]"))
    assert kilo.deviator.tolist() == [[5e3, -6e3, 1e3, 0, 2e3, 0]] * 20
    nine = ",".join(f"deviator:{n}" for n in range(9))  # of ParaView: a matrix row by row
    rows = "{i}e-4,{k}e-4,3e-6,5,0,2,0,-6,0,2,0,1"
    sample = read(tmp_path, lines(f"x,z,mass,{nine}", rows))
    assert sample.deviator.tolist() == [[5, -6, 1, 0, 2, 0]] * 20
    with pytest.raises(DustError, match=r"xx \+ yy \+ zz of particle 0 .from 0. is 8 Pa"):
        read(tmp_path, lines("x,z,mass,xx,yy,zz", "{i}e-4,{k}e-4,3e-6,5,2,1"))
    with pytest.raises(DustError, match="of its deviator it lacks yy, zz"):
        read(tmp_path, lines("x,z,mass,xx", "{i}e-4,{k}e-4,3e-6,5"))


@pytest.mark.parametrize(
    "text, message",
    [
        ("", "the file is empty; allowed: a list with the columns x z mass"),
        ("x,z,mass\n", "it has no particles; allowed: a list"),
        ("hello\n", r"line 1 \('hello'\) begins no list of particles; allowed: a list"),
        (lines("x,z", "{i}e-4,{k}e-4"), "it lacks mass; allowed: x z mass and optionally"),
        (lines("x,z,masse", "{i}e-4,{k}e-4,3e-6"), "lacks mass; .*; not read: masse"),
        (lines("x,mass,vx", "{i}e-4,3e-6,1"), "it lacks z; allowed: x, z"),
        (lines("x [kg],z [mm],mass", "{x},{z},3e-6"), "column x = '1 kg': a length is needed"),
        (lines("x [mm],z,mass", "{x},{z},3e-6"), r"others have none \(z\)"),
        (lines("x,z,mass [s]", "{i}e-4,{k}e-4,3e-6"), "'1 s': a mass per length is needed"),
        (PLAIN + "nan,5e-4,3e-6\n", "position of particle 20 .* finite numbers"),
        (PLAIN + "0,5e-4,nan\n", "mass of particle 20 .* positive numbers"),
        (PLAIN + "0,5e-4,-3e-6\n", "mass of particle 20 .* positive numbers"),
        (PLAIN + "0,5e-4,\n", "line 22: mass is ''; allowed: plain numbers"),
        (PLAIN + "0,5e-4\n", r"line 22 \('0,5e-4'\) has 2 columns; allowed: 3"),
        (PLAIN + "0,5e-4,N/A\n", "line 22: mass is 'N/A'; allowed: plain numbers"),
        (PLAIN + "2e-4,3e-4,3e-6\n", "particles 17 and 20 .* are at the same position"),
        (PLAIN + "2.0001e-4,3e-4,3e-6\n", "particles 17 and 20 .* are 10 nm apart"),
        (lines("x,y,z,mass", "{i}e-4,{k}e-4,{k}e-4,3e-6"), "its y differ; .* the plane is x-z"),
        # densities: of the dust, with its pores
        (lines("x,z,mass,density", "{i}e-4,{k}e-4,3e-6,3000"), "filling factor of 1.5; .* below"),
        (lines("x,z,mass,density", "{i}e-4,{k}e-4,3e-6,1200"), "above 0 and below 0.58"),
        (lines("x,z,mass,phi", "{i}e-4,{k}e-4,3e-6,0.6"), "above 0 and below 0.58"),
        (lines("x,z,mass,phi,rho", "{i}e-4,{k}e-4,3e-6,0.2,300"), "are not its filling factors"),
        (
            lines("x,z,mass,rho,reference", "{i}e-4,{k}e-4,3e-6,300,3"),
            "is 100 times its reference, the density without pressure; allowed: 0.5 to 2",
        ),
        # masses over densities are volumes of the spacing
        (lines("x,z,mass", "{i}e-4,{k}e-4,3e-4"), r"1e-06 m\^2, .* particles 1.075 mm apart"),
        (lines("x,z,mass", "{i}e-4,{k}e-4,3e-9"), "allowed: 0.25 to 2 times numerics.spacing"),
        (lines("x,z,mass,density", "{i}e-4,{k}e-4,3e-6,0.3"), "another unit may be in the header"),
        (PLAIN + "0,5e-4,3e-3\n", "density of particle 20 .from 0. is 1e-05"),
        # distances within reach of the kernel
        (lines("x,z,mass", "{i}e-3,{k}e-3,3e-6"), "particles are 1 mm apart .* reaches 260 µm"),
        (lines("x,z,mass", "{i},{k},3e-6"), "Are the lengths in the unit you meant"),
    ],
)
def test_files_that_are_refused(tmp_path, text, message):
    with pytest.raises(DustError, match=r"sample\.file = .*p\.csv.*" + message):
        read(tmp_path, text)


@pytest.mark.parametrize(
    "text, message",
    [
        (lines("x,z,mass", "{i}e-4,{k}e-4,9e-6"), "particles 186.1 µm apart, and numerics.spacing"),
        (lines("x,z,mass", "{i}e-4,{k}e-4,1e-6"), "particles 62.04 µm apart, and numerics.spacing"),
        (lines("x,z,mass", "{i}.9e-4,{k}.9e-4,3e-6", [(i * 2, k * 2) for i, k in GRID]),
         "and the nearest are 0.2 mm apart"),
        (PLAIN + "9e-3,0,3e-6\n", "1 of its 21 particles have no other within the reach"),
    ],
)  # fmt: skip
def test_volumes_and_distances_are_noted(tmp_path, text, message):
    (remark,) = read(tmp_path, text).info["remarks"]
    assert message in remark


def snapshots(path, role, density=300.0, **options):
    """A result of a run of the continuum with two snapshots of the grid."""
    x = SPACING * np.array([(i, 0.0, k) for i, k in GRID])
    frames = ("snapshot", "particle")
    data = {"position": ((*frames, "xyz"), np.stack([x + 1.0, x])), "role": ("particle", role)}
    data |= {"mass": ("particle", np.full(20, MASS), {"units": "kg"})}
    data |= {"density": (frames, np.full((2, 20), density), {"units": "kg/m^3"})}
    data |= {"reference_density": (frames, np.full((2, 20), 0.9 * density))}
    data |= {"deviator": ((*frames, "component"), np.full((2, 20, 6), [1.0, 1, -2, 3, 4, 5]))}
    data |= {name: (frames, np.zeros((2, 20))) for name in options}
    tree = xr.DataTree.from_dict({"/": xr.Dataset(), "/snapshots": xr.Dataset(data)})
    tree.to_netcdf(path)
    with netCDF4.Dataset(path, "a") as file:
        file.dusttaichi_version = "1"


def test_the_dust_of_a_run(tmp_path):
    """Its last snapshot, without rigid bodies; dust may be denser than a body may be at first."""
    file = {"kind": "explicit", "file": str(tmp_path / "result.nc")}
    role = np.where(np.arange(20) < 5, 1, 0)
    snapshots(tmp_path / "result.nc", role, density=1200.0, damage=True)
    sample = samples.make_particles(SPEC.validate_python(file), MATTER[2])
    assert len(sample) == 15 and sample.position[0].tolist() == [0.0, 0.0, 1e-4]
    assert sample.reference.tolist() == [1080.0] * 15
    assert sample.deviator.tolist() == [[1, 1, -2, 3, 4, 5]] * 15
    (remark,) = sample.info["remarks"]
    assert remark.endswith("result.nc: damage")
    snapshots(tmp_path / "result.nc", np.ones(20, int))
    with pytest.raises(DustError, match="none of its particles are dust"):
        samples.make_particles(SPEC.validate_python(file), MATTER[2])
    snapshots(tmp_path / "result.nc", role, density=2100.0)
    with pytest.raises(DustError, match="a filling factor of 1.05; .* above 0 and below 1"):
        samples.make_particles(SPEC.validate_python(file), MATTER[2])
