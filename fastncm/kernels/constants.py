"""Sizes, feature codes and tolerances of the compiled code, each with its reason."""

from fastncm.kernels.cache import JIT_OFF

#: Designs that stand side by side in the innermost axis of the work arrays: four AVX-512 registers.
#: More lanes share the overhead of each loop (a sweep takes 1.28, 0.71, 0.64, 0.59 us a solve with
#: 8, 16, 24, 32); with the JIT off (coverage) two are enough to exercise the masks.
LANES = 2 if JIT_OFF else 32

#: Most modes of a field (order 2 to 32; above that the force of no scene changes in double
#: precision).
MAX_ORDER = 32

# --- targets -----------------------------------------------------------------------------------
CIRCLE, BLOCK = 0, 1

# --- contact features: which part of the jaw touches which part of the target --------------------
# A point of the target (the circle's centre, the block's corner) seen from the jaw ...
ON_EDGE = 0  #: ... lies over the jaw's edge (segment or arc)
ON_A = 1  #: ... is nearest to corner a
ON_B = 2  #: ... is nearest to corner b
FAR_EDGE = 3  #: the block's far corner, at the other end of its underside, over the jaw's edge
ON_RETURN = 4  #: ... lies over the return face, from corner a down to the finger
FAR_RETURN = 5  #: the block's far corner over the return face
# A point of the jaw on a plane of the block:
A_UNDERSIDE, A_FACE, B_UNDERSIDE, B_FACE = 6, 7, 8, 9  #: a corner of the jaw
A_BACK = 10  #: corner a on the block's back, beyond its far corner
ARC_UNDERSIDE, ARC_FACE = 11, 12  #: the point of a convex arc whose normal is the plane's
VOID = 13  #: the pair does not face each other

# --- columns of a design's jaw array (dimensionless, in the tip's frame) -------------------------
AX, AY, BX, BY = 0, 1, 2, 3  #: corners a and b
TAX, TAY, TBX, TBY = 4, 5, 6, 7  #: unit tangents at a and at b, both in the sense a -> b
MX, MY = 8, 9  #: centre of the arc
RHO = 10  #: radius of the arc, positive: convex, negative: concave, 0: straight
TRX, TRY = 11, 12  #: unit tangent of the return face, towards a
JAW_COLUMNS = 13
# --- columns of a design's target array ----------------------------------------------------------
TARGET_RADIUS, TARGET_Y = 0, 1
TARGET_LENGTH = 2  #: of a block's underside, 0: endless
TARGET_COLUMNS = 3

#: Gap of a pair that does not face each other (one finger length: never binding).
VOID_GAP = 1.0
#: Angle up to which an edge counts as flat on a side of the block, so that it may touch in two
#: places.
FLAT = 0.05
#: Height above the underside (finger lengths) up to which a corner of the jaw counts as under it.
UNDER = 1e-9

# --- forms of the contact constraints ------------------------------------------------------------
CLOSEST, POINTS_ON_FINGER, POINTS_ON_TARGET = 0, 1, 2

# --- a gap and its derivatives by the pose (tuple of `kernels.gap`, rows of work arrays) ---------
GAP, GX, GY, GP, HXX, HXY, HYY, HXP, HYP, HPP, PX, PY, FEATURE = range(13)
GAP_COLUMNS = 13

# --- arithmetic ---------------------------------------------------------------------------------
#: Error of a gap (in finger lengths) that is due to rounding: some ten operations on numbers near
#: 1.
GAP_ROUNDING = 4e-16
#: KKT residual up to which a contact so light that rounding decides (gap below GAP_ROUNDING) is
#: accepted.
GRAZING = 1e-3
