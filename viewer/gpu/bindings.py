"""Bindings: which number each thing that a shader reads or writes is bound to, by meaning.

Every shader has them as TEXTURE_, STORAGE_ and BLOCK_ with the names below.
"""

from __future__ import annotations

from enum import IntEnum, auto, unique
from functools import cache


class Texture(IntEnum):
    """Texture units, of which a driver has 96 or more: all but those at the end have their own. A stage
    reads up to 16."""

    # Images, below 15, the least unit that moderngl makes textures at.
    PICTURE = 0  # shaded
    COLOR_SUMS = auto()  # of splats that are blended, and their weight
    NORMAL_SUMS = auto()
    LARGE_ROWS = auto()  # what splats that are too large for tiles filled
    LARGE_DEPTHS = auto()
    # A Surface, a texel a pixel.
    DEPTHS = 16  # float bits
    ROWS = auto()
    OWN_COLORS = auto()
    LEVELS = auto()
    OWN_NORMALS = auto()
    OWN_VALUES = auto()
    # A pose, a texel a row.
    POSITIONS = auto()
    NORMALS = auto()  # of a Surface where the backend wrote them
    COLORS = auto()  # of a Surface where the backend wrote them
    RADII = auto()
    AXES = auto()
    SPLATS = auto()  # normal, radius and half-axes in three words
    IDS = auto()
    VALUES = auto()  # of a scalar
    LOOKS = auto()  # colour and normal in two words
    DRAWN_ROWS = auto()  # the list of those that are drawn
    CORNERS = auto()  # of faces
    COLOR_MAP = auto()
    # Scatter and bins.
    KEYS = auto()
    BEST = auto()
    PAIRS = auto()
    STARTS = auto()
    LISTED = auto()
    # Targets of pyramidal projection, with keys and best.
    SPOTS = auto()
    SHOWN = auto()
    KERNELS = auto()  # point spread functions
    SUMS = auto()  # of such
    RANGE_NORMALS = auto()  # of samples of range views
    # A level of a pyramid that is read, one beside it, and the weights of one that is filled.
    SAMPLES = auto()
    WEIGHTS = auto()
    DETAIL = auto()
    KNOWN_WEIGHTS = auto()
    GUIDE = auto()  # that tells which samples are in front
    # Tiles of splats.
    CENTERS = auto()
    FORMS = auto()
    REACH = auto()
    WORK = auto()
    FARTHEST = auto()
    NOTED = auto()  # points whose discs are listed
    AWAY = auto()  # those whose discs face away
    AWAY_STARTS = auto()  # of discs that face away
    AWAY_LISTED = auto()
    NUMBERS = auto()  # of the discs of points
    DISC_LOOKS = auto()
    DISCS = auto()  # of each row of a pose
    # Chunks of points.
    BOXES = auto()
    FARTHEST_TILES = auto()
    CONES = auto()  # round their normals
    REACHES = auto()  # of their splats
    ARRANGED = auto()  # points in their order
    CHUNK_ROWS = auto()  # of points in the order of chunks
    CHUNK_NUMBERS = auto()  # of rows
    # Neighborhoods, beside splats.
    SLOTS = auto()  # participants in the order of their cells
    NEAR_TO = auto()
    USUAL = auto()
    COUNTS = auto()
    FOUND = auto()  # what a neighborhood tells
    # Samples of range views.
    RANGE_DEPTHS = auto()
    RANGE_LOOKS = auto()
    RANGE_XY = auto()
    RANGE_TILES = auto()
    RANGE_VIEWS = auto()
    # Hidden points, with keys and best: of sectors.
    HOMES = auto()  # sector and key of each row
    OCCUPIED = auto()  # cells of sectors that points fall into
    VISIBLE = auto()  # rows that are
    COPIES = auto()  # rows for which a lower one stands
    LIMITS = auto()  # of cells, beyond which points are hidden
    WINDOWS = auto()  # of blocks of cells: how many cells aside discs lie that reach into them
    SIGHTS = auto()  # of listed points, and how far each covers what lies behind
    # What is shown of visible points.
    CANDIDATES = auto()  # a row for each sector
    SPACINGS = auto()
    JOINED = auto()  # rows that are a face's corners
    # Means of pictures.
    LIGHT = auto()  # of bytes
    ENCODED = auto()  # bytes of light
    SHADED = auto()  # a picture that is softened, a word a pixel
    # Code words.
    ELEMENTS = auto()  # points in steps of the table
    SHAPES = auto()  # the table
    SHAPE_ROWS = auto()  # of shapes larger than a word
    MATERIALS = auto()  # of points
    SCRATCH = auto()  # where buffers become textures
    # Nodes of an octree, beside a pose; no program reads these and hidden points.
    NODE_MASKS = HOMES  # which children there are
    FIRST_CHILDREN = OCCUPIED
    NODE_CELLS = VISIBLE
    NODE_OFFSETS = COPIES  # of the surface in their cells
    NODE_COLORS = LIMITS
    # Coarse cells in which a copy of a point takes no part; no program reads these and hidden points.
    COPIED = HOMES
    # What fillings of lists counted, beside points; no program reads this and hidden points.
    FILLED = HOMES
    # Cells of points, to which splats are fitted, beside a pose; no program reads these and targets.
    CELLS = SPOTS


class Storage(IntEnum):
    """Binding points of storage blocks: eight, as every driver has. Names of one group have numbers of their
    own; those of different groups share some, and no program has two of one number (tests/gpu)."""

    # A Surface, a word or more a pixel, and lists of its pixels.
    DEPTHS = 0
    ROWS = 1
    LIST = 2
    DISPATCH = 3  # over the list, and its length
    COLOR = 4  # Surface.own
    NORMAL = 5
    VALUE = 6
    LEVEL = 7
    # Shading, beside a list.
    PICTURE = 0
    PIXEL_BITS = 1
    LIGHT_SUMS = 1
    CLEARED_PICTURE = 4  # beside depths, rows and a list
    # Scatter, beside a list; what says which cells are visited has those from 4 on.
    KEYS = 0
    BEST = 1
    HITS = 7  # cells that were hit
    SPLIT_KEYS = 2  # of 64-bit cells, which are bound as keys; beside best
    # Chunks of points, beside a list.
    FARTHEST_TILES = 0
    BOXES = 0
    CONES = 1
    REACHES = 4
    ARRANGED = 0
    DRAWN_INDICES = 0
    SEEN = 4
    # Bins, beside what says which cells are visited, which has those from 2 on.
    CURSORS = 0
    VISITS = 1
    # Their sorting.
    DIGITS = 0
    SORTED = 1
    # Prefix sums; what says the words has those up to 5.
    WORDS = 0
    BLOCK_SUMS = 6
    # A level of a pyramid that is written.
    SAMPLES = 0
    WEIGHTS = 1
    # Targets of pyramidal projection, with keys and best.
    SPOTS = 2
    SHOWN = 3
    # Tiles of range views that are drawn, beside a list.
    RANGE_NORMALS = 0
    RANGE_ROWS = 1
    TILE_COUNTS = 4
    # Depths of the local surface, beside a Surface's depths, rows, colours, normals and lists.
    LOCAL_DEPTHS = 6
    # Sums of splats, beside a Surface's colours, normals and lists.
    SUMS = 0
    # Tiles of splats, beside bins, prefix sums and a Surface's depths, rows and lists.
    STARTS = 0
    WORK = 1
    CENTERS = 2
    FILLED = 2
    FORMS = 3
    NOTED = 3
    REACH = 4
    DISC_LOOKS = 4
    LARGE = 5
    NUMBERS = 5
    AGAIN = 6
    AWAY = 6
    FARTHEST = 7
    NEAREST = 7
    # Neighborhoods and their splats, beside a list.
    SPLATS = 0
    FOUND = 1
    PLACES = 1
    SLOTS = 0
    DRAWN_ROWS = 1
    NEAR_TO = 0
    USUAL = 0
    LOOKS = 6
    TOTALS = 4
    EXTENTS = 4
    COUNTS = 5
    NEXT = 5
    COPIED = 4
    KEPT = 7
    # Splats that become smaller, beside the forms of tiles.
    RADII = 4
    DISCS = 5
    # Gaps round points, beside radii, slots and a list.
    CELL_AXES = 5
    CELLS = 6
    # Hidden points, beside scatter and a list.
    POINT_SPOTS = 4
    HOMES = 5
    OCCUPIED = 6
    NEXT_LIST = 4
    NEXT_DISPATCH = 5
    STAMPS = 6
    NEXT_ROWS = 7
    VISIBLE = 0
    LIMITS = 0
    SIGHTS = 6
    WINDOWS = 7
    # What is shown of visible points, beside two lists, splats and looks; and levels of pyramids.
    SPACINGS = 1
    JOINED = 6
    LOOK_SAMPLES = 2
    COLOR_SAMPLES = 3
    # Views that are merged, beside a Surface, or a list.
    VIEW_PICTURE = 0
    MERGED = 1
    WINNERS = 4
    BANDS = 4
    BAND_SHARES = 5
    MERGED_BANDS = 6
    # Samples of range views: a level that is made.
    RANGE_DEPTHS = 0
    RANGE_LOOKS = 1
    RANGE_XY = 2
    RANGE_TILES = 0
    RANGE_VALUES = 0
    # Code words: elements; and what is written line by line, beside the cursors of bins.
    ELEMENTS = 0
    HEADS = 1
    SPREAD = 2
    LINE_WORDS = 1
    RANKS = 2
    # The cut of an octree.
    SIGHT = 0
    CUT_TOTALS = 1
    NODES = 2
    CHILDREN = 3
    SHOWN_NODES = 4
    BLOCK_COUNTS = 5
    BLOCK_STARTS = 6
    NODE_CELLS = 2
    # What is drawn of it, beside the view and the totals.
    CUT_POSITIONS = 2
    CUT_NORMALS = 3
    CUT_RADII = 4
    CUT_COLORS = 5
    CUT_OCTANTS = 6
    CUT_FACTS = 0


@unique
class UniformBlock(IntEnum):
    """Binding points of uniform blocks."""

    VIEW = 0  # the camera
    POINTS = auto()  # a range of points, for one way of instancing
    PARAMS = auto()  # the values that a primitive or a backend gives its shaders


@cache
def texture(name: str) -> Texture:
    """The texture unit of an array by its name in lower case. Raises KeyError where there is none."""
    return Texture[name.upper()]


@cache
def storage(name: str) -> Storage:
    """The storage block of an array by its name in lower case. Raises KeyError where there is none."""
    return Storage[name.upper()]


def bindings_glsl() -> str:
    """The numbers as macros."""
    tables: tuple[tuple[str, type[IntEnum]], ...] = (
        ("TEXTURE", Texture),
        ("STORAGE", Storage),
        ("BLOCK", UniformBlock),
    )
    return "".join(
        f"#define {kind}_{name} {number:d}\n"
        for kind, table in tables
        for name, number in table.__members__.items()
    )
