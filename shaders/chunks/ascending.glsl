// Whether a row is in one of the listed chunks: for lists in the order of rows.
layout(binding = TEXTURE_CHUNK_NUMBERS) uniform usamplerBuffer chunk_numbers;  // of each row
layout(std430, binding = STORAGE_SEEN) readonly buffer Seen { uint seen[]; };  // as chunks/cull.comp has it

uniform uint listed_bit;

bool is_listed(uint i) { return (seen[texelFetch(chunk_numbers, int(i)).r] & listed_bit) != 0u; }
