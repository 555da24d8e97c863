// A unit vector on an octahedron's net (Cigolle et al. 2014).
vec2 folded(vec3 normal) {
    vec2 net = normal.xy / dot(abs(normal), vec3(1.0));
    vec2 turned = (1.0 - abs(net.yx)) * vec2(net.x < 0.0 ? -1.0 : 1.0, net.y < 0.0 ? -1.0 : 1.0);
    return normal.z < 0.0 ? turned : net;
}

vec3 unfolded(vec2 net) {
    precise vec3 normal = vec3(net, 1.0 - abs(net.x) - abs(net.y));
    float under = max(-normal.z, 0.0);
    normal.xy -= vec2(normal.x < 0.0 ? -under : under, normal.y < 0.0 ? -under : under);
    normal = normalize(normal);
    return normal;
}

// A unit normal in a word that is not 0; 0: none. (0, 0, 1) is kept as its like: the net holds it in no other word.
uint pack_normal(vec3 normal) {
    uint word = packSnorm2x16(folded(normal));
    return normal == vec3(0.0) ? 0u : word == 0u ? 1u : word;
}

vec3 unpack_normal(uint word) {
    vec3 normal = unfolded(unpackSnorm2x16(word));
    return word == 0u ? vec3(0.0) : normal;
}
