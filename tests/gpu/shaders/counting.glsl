// Items that give 1 and -2 to a cell, going by their number.
uniform uint modulus;

void scatter(uint i) { add(i % modulus, float[](1.0, -2.0)); }
