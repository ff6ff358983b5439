package com.kuka.roboticsAPI.uiModel;

import com.kuka.roboticsAPI.uiModel.userKeys.IUserKeyBar;

/** The smartPAD, as far as an application may use it. */
public interface IApplicationUI {
    IUserKeyBar createUserKeyBar(String name);
}
