// Items that visit one cell, going by their number.
uniform uint modulus;

void scatter(uint i) { visit(i % modulus, i / modulus, i); }
