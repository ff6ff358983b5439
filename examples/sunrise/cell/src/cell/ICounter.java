package cell;

/** What the cell's watcher offers to applications. */
public interface ICounter {
    /** How often the gripper has closed since the cabinet started. */
    int closings();
}
