// Waits for all invocations of a work group, and for what they wrote to shared memory.
void meet() {
    memoryBarrierShared();
    barrier();
}
