// The first pass of splats as Slomp 2014 prints it (V-B): the rasteriser writes depths of whole quads, and nothing else.
void main() {}
