// Which level of a view has samples as far apart as pixels (`detail`), at a place (screen view space) that it sees and that lies
// at a depth: a number between levels, below 0 where the picture is finer than the view. Levels up to it have no gaps.
float level_that_fits(RangeView v, vec3 place, float depth) {
    float away = v.kind == RANGE_HEIGHT ? 1.0 : length(to_screen_view(v, vec3(0.0)) - place);
    float apart = sample_spacing(v, 0, away) * scale_at(depth);
    return log2(detail / apart) + 1e-3;
}
