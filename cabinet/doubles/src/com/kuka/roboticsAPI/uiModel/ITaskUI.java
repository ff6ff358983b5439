package com.kuka.roboticsAPI.uiModel;

import com.kuka.roboticsAPI.uiModel.userKeys.IUserKeyBar;

/** Interface of a task to the smartPAD. */
public interface ITaskUI {
    IUserKeyBar createUserKeyBar(String name);
}
