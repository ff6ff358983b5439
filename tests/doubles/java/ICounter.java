package sample;

/** A function that a background task provides to others. */
public interface ICounter {
    int count();

    void reset();
}
