// Remainder and quotient of whole numbers from 0 on. By floats and a correction: processors have no integer division of
// several numbers at once, so that software drivers take it one by one.
ivec2 split(int number, int by) {
    int quotient = int(float(number) / float(by)), rest = number - quotient * by;
    int missed = rest < 0 ? -1 : rest >= by ? 1 : 0;
    return ivec2(rest - missed * by, quotient + missed);
}
