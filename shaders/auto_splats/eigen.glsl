// Eigenvalues and -vectors of a symmetric matrix by Jacobi's rotations: right for equal ones, and for very
// different ones. `sweeps` is a parameter, as graphics cards take long to compile what they unroll.

// The rotation that makes the element pq zero.
void rotate(inout float pp, inout float qq, inout float pq, inout float rp, inout float rq, inout vec3 p,
inout vec3 q) {
    float theta = 0.5 * (qq - pp) / pq;
    float t = pq == 0.0 ? 0.0 : (theta < 0.0 ? -1.0 : 1.0) / (abs(theta) + sqrt(theta * theta + 1.0));
    float c = inversesqrt(t * t + 1.0), s = t * c;
    pp -= t * pq;
    qq += t * pq;
    pq = 0.0;
    vec2 r = vec2(c * rp - s * rq, s * rp + c * rq);
    rp = r.x;
    rq = r.y;
    vec3 turned = c * p - s * q;
    q = s * p + c * q;
    p = turned;
}

void put_in_order(inout float less, inout float more, inout vec3 p, inout vec3 q) {
    if (less <= more) return;
    float value = less;
    less = more;
    more = value;
    vec3 vector = p;
    p = q;
    q = vector;
}

// diagonal: xx, yy, zz; others: yz, zx, xy. Values ascending, and their vectors as columns.
vec3 eigen(vec3 diagonal, vec3 others, out mat3 vectors) {
    float xx = diagonal.x, yy = diagonal.y, zz = diagonal.z, yz = others.x, zx = others.y, xy = others.z;
    vec3 x = vec3(1.0, 0.0, 0.0), y = vec3(0.0, 1.0, 0.0), z = vec3(0.0, 0.0, 1.0);
    for (int sweep = 0; sweep < sweeps; ++sweep) {
        rotate(xx, yy, xy, zx, yz, x, y);
        rotate(yy, zz, yz, xy, zx, y, z);
        rotate(zz, xx, zx, yz, xy, z, x);
    }
    put_in_order(xx, yy, x, y);
    put_in_order(yy, zz, y, z);
    put_in_order(xx, yy, x, y);
    vectors = mat3(x, y, z);
    return vec3(xx, yy, zz);
}
