// Items that give numbers, CHANNELS each, to one cell.
layout(std430, binding = 6) readonly buffer Cells { uint cells[]; };
layout(std430, binding = 7) readonly buffer Given { float given[]; };

void scatter(uint i) {
    float numbers[CHANNELS];
    for (uint k = 0u; k < CHANNELS; ++k) numbers[k] = given[CHANNELS * i + k];
    add(cells[i], numbers);
}
